//! The methods, each with its paper, its bias and its cost.
//!
//! | method | paper | biased | needs |
//! | --- | --- | --- | --- |
//! | [`Jittered`] | Cook 1986 | no | |
//! | [`Sobol`] | Owen 1995 | no | |
//! | [`Interlaced`] | Dick 2011 | no | pays where the integrand is smooth |
//! | [`ProductGauss`] | classical | yes (deterministic) | smoothness |
//! | [`DirectIndirect`] | report, 3.1 | no | where the luminaires are |
//! | [`WardShadows`] | Ward 1991 | yes | luminaires and their unoccluded contributions |
//! | [`ShirleyWang`] | Shirley and Wang 1991 | no | luminaires |
//! | [`KirkArvo`] | Kirk and Arvo 1991 | no | luminaires and casters |
//! | [`PainterSloan`] | Painter and Sloan 1989; report, 3.2 | yes | |
//! | [`Glassner`] | Glassner 1993 | yes | |
//! | [`BeyerLange`] | Beyer and Lange 1994 | yes | |
//! | [`DelaunayAdaptive`] | report, 3.2 | yes | |
//! | [`Enlarged`] | report, 4 | yes | luminaires that can be enlarged |
//! | [`Shrinking`] | report, 4 | yes | luminaires that can be enlarged |
//! | [`TwoStage`] | Kirk and Arvo 1991 | no | |
//! | [`Sequential`] | | no | |
//! | [`Predicted`] | Veach and Guibas 1995 | no | a prediction |
//! | [`LinearControl`] | | no | |
//! | [`GenzMalik`] | Genz and Malik 1980 | no | |

mod adaptive;
mod control;
mod draw;
mod genz_malik;
mod known;
mod luminaires;
mod plain;
mod predicted;
mod sequential;
mod train;
mod two_stage;
mod ward;

pub use adaptive::{BeyerLange, PainterSloan, Plan, Sizing, refine};
#[cfg(feature = "delaunay")]
pub use adaptive::{DelaunayAdaptive, Glassner};
pub use control::LinearControl;
pub use draw::{LeafDensity, Placed};
pub use genz_malik::GenzMalik;
pub use known::{DirectIndirect, KirkArvo, Region, ShirleyWang};
pub use luminaires::{Enlarged, Shrinking, ShrinkingOn};
pub use plain::{Interlaced, Jittered, ProductGauss, ProductRule, Sobol};
pub use predicted::{Predicted, Prediction};
pub use sequential::Sequential;
pub use train::Trained;
pub use two_stage::TwoStage;
pub use ward::{History, WardShadows};

use crate::estimate::Estimate;
use crate::gap::Gap;
use crate::integrand::{Integrand, Probe};
use crate::map::Uv;
#[cfg(feature = "delaunay")]
use crate::partition::{Delaunay, Voronoi};
use crate::partition::{Partition, QuadTree, Triangles};
use crate::points::Key;
use crate::value::Value;

/// A way to integrate over the unit square within a number of evaluations.
pub trait Method<V: Value> {
    /// Its name, as the tables show it.
    fn name(&self) -> &'static str;

    /// Integrates `f` with about `budget` evaluations (never more, unless the documentation of the method says so). The same
    /// key gives the same result. Nothing is allocated once the workspace has served a call of this size.
    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V>;

    /// Which partition of the workspace the method has refined, for drawing it ([`Workspace::outlines`]).
    fn leaves(&self) -> Option<Leaves> {
        None
    }
}

/// Partitions that a method may leave behind in its workspace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// Squares.
    QuadTree,
    /// Squares with a density of their own.
    Trained,
    /// Voronoi cells.
    #[cfg(feature = "delaunay")]
    Voronoi,
    /// Triangles on the square.
    #[cfg(feature = "delaunay")]
    Delaunay,
    /// Triangles on the hemisphere.
    Triangles,
}

/// Memory that methods use and leave behind for the next call. One per thread.
#[derive(Debug)]
pub struct Workspace<V> {
    pub(crate) draw: draw::Draw<V>,
    pub(crate) refine: adaptive::Refine<V>,
    pub(crate) tree: QuadTree,
    pub(crate) triangles: Triangles,
    #[cfg(feature = "delaunay")]
    pub(crate) voronoi: Voronoi,
    #[cfg(feature = "delaunay")]
    pub(crate) delaunay: Delaunay,
    pub(crate) trained: Trained<V>,
    pub(crate) control: control::Models<V>,
    pub(crate) cubature: genz_malik::Regions<V>,
}

impl<V: Value> Default for Workspace<V> {
    fn default() -> Self {
        Workspace::new()
    }
}

impl<V: Value> Workspace<V> {
    /// An empty workspace; the first call of a method fills it.
    pub fn new() -> Self {
        Workspace {
            draw: Default::default(),
            refine: Default::default(),
            tree: QuadTree::default(),
            triangles: Triangles::default(),
            #[cfg(feature = "delaunay")]
            voronoi: Voronoi::default(),
            #[cfg(feature = "delaunay")]
            delaunay: Delaunay::default(),
            trained: Trained::default(),
            control: Default::default(),
            cubature: Default::default(),
        }
    }
}

impl<V: Value> Workspace<V> {
    /// Visits the boundaries (closed polygons on the square) and areas of the cells that the last call left behind.
    pub fn outlines(&self, leaves: Leaves, visit: &mut dyn FnMut(&[Uv<f64>], f64)) {
        match leaves {
            Leaves::QuadTree => outlines(&self.tree, visit),
            Leaves::Trained => outlines(self.trained.tree(), visit),
            #[cfg(feature = "delaunay")]
            Leaves::Voronoi => outlines(&self.voronoi, visit),
            #[cfg(feature = "delaunay")]
            Leaves::Delaunay => outlines(&self.delaunay, visit),
            Leaves::Triangles => outlines(&self.triangles, visit),
        }
    }
}

fn outlines(partition: &impl Partition, visit: &mut dyn FnMut(&[Uv<f64>], f64)) {
    let mut polygon = Vec::new();
    for cell in (0..partition.cells()).filter(|c| partition.is_cell(*c)) {
        partition.outline(cell, &mut polygon);
        visit(&polygon, partition.area(cell));
    }
}

/// Evaluates the integrand at points that are all at hand, in one batch.
pub(crate) fn evaluate<V: Value>(f: &mut dyn Integrand<V>, probes: &[Probe], values: &mut Vec<V>) {
    let start = values.len();
    values.resize(start + probes.len(), V::default());
    f.eval(probes, &mut values[start..]);
}

/// The largest gap between probes.
pub(crate) fn gap_of(gap: &mut Gap, points: &[Uv<f64>]) -> f64 {
    gap.radius(points.len(), |i| points[i])
}
