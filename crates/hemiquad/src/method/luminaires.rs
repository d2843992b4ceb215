//! Luminaires made larger than they are (report, section 4). *Biased*: by (k - 1)A/2 on the report's pixel.

use super::adaptive::{Plan, Sizing, run};
use super::{Leaves, Method, Workspace};
use crate::criterion::Weighted;
use crate::estimate::Estimate;
use crate::integrand::{Integrand, Probe, Size, Stage};
use crate::partition::Parent;
use crate::points::Key;
use crate::value::Value;

/// Any method with all luminaires enlarged k times in area and dimmed as much. *Biased.*
#[derive(Clone, Copy, Debug)]
pub struct Enlarged<M> {
    /// By how much, in area; at least 1.
    pub k: f64,
    /// The method.
    pub inner: M,
}

struct Enlarge<'f, V> {
    k: f64,
    f: &'f mut dyn Integrand<V>,
}

impl<V: Value> Integrand<V> for Enlarge<'_, V> {
    fn eval(&mut self, at: &[Probe], out: &mut [V]) {
        let mut larger = [Probe::default(); 64];
        for (probes, out) in at.chunks(64).zip(out.chunks_mut(64)) {
            for (l, p) in larger.iter_mut().zip(probes) {
                *l = Probe { size: Size::Times(self.k), ..*p };
            }
            self.f.eval(&larger[..probes.len()], out);
        }
    }
}

impl<V: Value, M: Method<V>> Method<V> for Enlarged<M> {
    fn name(&self) -> &'static str {
        "Enlarged"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let mut larger = Enlarge { k: self.k.max(1.0), f };
        let inner = self.inner.integrate(&mut larger, budget, key, work);
        Estimate { biased: true, ..inner }
    }

    fn leaves(&self) -> Option<Leaves> {
        self.inner.leaves()
    }
}

/// Which partition the luminaires shrink on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShrinkingOn {
    /// The quadtree; every child draws its own sample, at its own size.
    #[default]
    QuadTree,
    /// The Delaunay triangulation; a sample keeps the size it was made with.
    #[cfg(feature = "delaunay")]
    Delaunay,
}

/// Shrinking luminaires: while a partition is refined, luminaires are as large as the asking cell is sure to hit, and so shrink
/// with the cells. *Biased* where the refinement ends before they have shrunk to their size.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shrinking<'a> {
    /// Which cell is next.
    pub criterion: Weighted<'a>,
    /// On what.
    pub on: ShrinkingOn,
}

/// Radius, in sides of a square cell, that one jittered sample per cell cannot miss: √2 (the erratum to section 4).
pub const SURE: f64 = std::f64::consts::SQRT_2;

impl<V: Value> Method<V> for Shrinking<'_> {
    fn name(&self) -> &'static str {
        match self.on {
            ShrinkingOn::QuadTree => "Shrinking quadtree",
            #[cfg(feature = "delaunay")]
            ShrinkingOn::Delaunay => "Shrinking Delaunay",
        }
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let plan = Plan {
            criterion: self.criterion,
            initial: (budget / 4).max(1),
            total: budget.max(1),
            stage: Stage::Estimate,
            sizing: Sizing::Shrinking(SURE),
        };
        match self.on {
            ShrinkingOn::QuadTree => {
                work.tree.set_parent(Parent::Drop);
                run(&mut work.tree, f, &plan, key, &mut work.refine)
            }
            #[cfg(feature = "delaunay")]
            ShrinkingOn::Delaunay => run(&mut work.delaunay, f, &plan, key, &mut work.refine),
        }
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(match self.on {
            ShrinkingOn::QuadTree => Leaves::QuadTree,
            #[cfg(feature = "delaunay")]
            ShrinkingOn::Delaunay => Leaves::Delaunay,
        })
    }
}
