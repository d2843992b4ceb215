//! Taking a BSDF apart into what zones can stand for and what must be followed.

use super::{Bsdf, Lobe, LobeClass};

impl Bsdf {
    /// Whether some lobe is diffuse: broad enough for a zone's irradiance to stand for what arrives.
    #[inline]
    pub fn has_diffuse(&self) -> bool {
        self.lobes().iter().any(|l| l.kind() == LobeClass::Diffuse)
    }

    /// The lobes of which `keep` is true.
    pub fn keeping(&self, keep: impl Fn(&Lobe) -> bool) -> Bsdf {
        let mut some = Bsdf::none();
        for lobe in self.lobes().iter().filter(|l| keep(l)) {
            some.push(*lobe);
        }
        some
    }

    /// The lobes that are not diffuse.
    pub fn without_diffuse(&self) -> Bsdf {
        let mut narrow = Bsdf::none();
        for lobe in self.lobes().iter().filter(|l| l.kind() != LobeClass::Diffuse) {
            narrow.push(*lobe);
        }
        narrow
    }

    /// The lobes that are.
    pub fn only_diffuse(&self) -> Bsdf {
        let mut diffuse = Bsdf::none();
        for lobe in self.lobes().iter().filter(|l| l.kind() == LobeClass::Diffuse) {
            diffuse.push(*lobe);
        }
        diffuse
    }
}
