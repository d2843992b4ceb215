//! Luminaires that hints favour: a share of the picks that goes to them wherever the receiver is, and the picks of particles
//! that start from them.
//!
//! The probability of every pick is (1 − Σ shares) times the plain one plus its own share, so what is not favoured keeps at
//! least half ([`MOST_SHARE`]) of its picks, and estimates keep their mean.

use super::World;
use super::luminaire::{Luminaires, NO_LUMINAIRE};
use crate::hints::MOST_SHARE;
use hemilux_scene::hints::ShapeRef;

/// What can be picked: a unit of the light hierarchy, or a sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Pick {
    Unit(u32),
    Sky(u32),
}

/// Shares of picks.
#[derive(Clone, Debug, Default)]
pub(super) struct Favoured {
    /// All of them.
    pub share: f32,
    /// Each with its share, in order.
    picks: Vec<(Pick, f32)>,
}

impl Favoured {
    /// The favoured pick for `u`; `None`: `u` is not among theirs.
    pub fn pick(&self, u: f32) -> Option<Pick> {
        if u >= self.share {
            return None;
        }
        let mut left = u;
        let found = self.picks.iter().find(|p| {
            left -= p.1;
            left < 0.0
        });
        found.or(self.picks.last()).map(|p| p.0)
    }

    /// The probability of a pick whose plain one is `plain`.
    #[inline]
    pub fn with(&self, plain: f32, pick: Pick) -> f32 {
        if self.picks.is_empty() {
            return plain;
        }
        let own = self.picks.binary_search_by_key(&pick, |p| p.0).map_or(0.0, |i| self.picks[i].1);
        (1.0 - self.share) * plain + own
    }
}

/// Shapes, environments and the share of the shadow rays that they are given.
pub(super) type Favour<'a> = (&'a [ShapeRef], &'a [u32], f32);

impl Luminaires {
    /// Shares as hints ask for them, each spread over its luminaires by power.
    pub(super) fn favours(&self, world: &World, asked: &[Favour]) -> Favoured {
        let scale = (MOST_SHARE / asked.iter().map(|a| a.2).sum::<f32>()).min(1.0);
        let mut picks: Vec<(Pick, f32)> = Vec::new();
        for (shapes, environments, share) in asked {
            let items = self.items_of(world, shapes, environments);
            let power: f32 = items.iter().map(|i| self.items[*i as usize].pick).sum();
            if power <= 0.0 {
                continue;
            }
            for i in items {
                let sky = self.sky_items.iter().position(|s| *s == i);
                let pick = match sky {
                    Some(s) => Pick::Sky(s as u32),
                    None => Pick::Unit(self.unit_of[i as usize]),
                };
                picks.push((pick, scale * share * self.items[i as usize].pick / power));
            }
        }
        picks.retain(|p| p.1 > 0.0);
        picks.sort_by_key(|p| p.0);
        picks.dedup_by(|later, first| {
            let same = later.0 == first.0;
            first.1 += if same { later.1 } else { 0.0 };
            same
        });
        Favoured { share: picks.iter().map(|p| p.1).sum(), picks }
    }

    /// Use them.
    pub(super) fn favour(&mut self, favoured: Favoured) {
        self.favoured = favoured;
    }

    /// Luminaires of shapes (in all of their instances) and environments, in order.
    fn items_of(&self, world: &World, shapes: &[ShapeRef], environments: &[u32]) -> Vec<u32> {
        let mut items = Vec::new();
        let mut add = |base: Option<&u32>, group: u32, shape: u32| {
            let Some(&first) = base.filter(|b| **b != NO_LUMINAIRE) else { return };
            let prims = &world.groups[group as usize].first_prim;
            items.extend(first..first + prims[shape as usize + 1] - prims[shape as usize]);
        };
        for s in shapes {
            match s.object {
                None => add(self.world_base.get(s.shape as usize), 0, s.shape),
                Some(o) => {
                    let placed =
                        world.placements.iter().zip(&self.instance_base).filter(|p| p.0.group == o + 1);
                    placed.for_each(|(p, base)| add(base.get(s.shape as usize), p.group, s.shape));
                }
            }
        }
        items.extend(environments.iter().filter_map(|e| self.sky_items.get(*e as usize)));
        items.sort_unstable();
        items.dedup();
        items
    }

    /// Intervals of the picks by power that lead to these luminaires.
    pub(crate) fn intervals(
        &self,
        world: &World,
        shapes: &[ShapeRef],
        environments: &[u32],
    ) -> Vec<[f64; 2]> {
        let mut found: Vec<[f64; 2]> = Vec::new();
        for i in self.items_of(world, shapes, environments) {
            let i = i as usize;
            let (low, high) = (if i == 0 { 0.0 } else { self.cumulative[i - 1] }, self.cumulative[i]);
            match found.last_mut() {
                Some(last) if last[1] == low => last[1] = high,
                _ if high > low => found.push([low, high]),
                _ => {}
            }
        }
        found
    }
}
