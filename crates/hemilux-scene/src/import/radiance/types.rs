//! The types of primitives and the arguments they take.

/// What a primitive is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Geometry.
    Surface,
    /// Scattering and emission.
    Material,
    /// Disturbs normals or modulates a material.
    Pattern,
    /// Blends two modifiers.
    Mixture,
}

/// One type.
#[derive(Clone, Copy, Debug)]
pub struct Type {
    /// As files spell it.
    pub name: &'static str,
    /// What it is good for.
    pub class: Class,
    /// Least and most number of real arguments.
    pub reals: (usize, usize),
    /// Least number of string arguments.
    pub strings: usize,
    /// Whether this importer knows what to do with it.
    pub supported: bool,
}

const ANY: usize = usize::MAX;

const fn surface(name: &'static str, least: usize, most: usize) -> Type {
    Type { name, class: Class::Surface, reals: (least, most), strings: 0, supported: true }
}

const fn material(name: &'static str, least: usize, most: usize, strings: usize) -> Type {
    Type { name, class: Class::Material, reals: (least, most), strings, supported: true }
}

const fn missing(name: &'static str, class: Class) -> Type {
    Type { name, class, reals: (0, ANY), strings: 0, supported: false }
}

/// All of them.
pub const TYPES: &[Type] = &[
    surface("polygon", 9, ANY),
    surface("sphere", 4, 4),
    surface("bubble", 4, 4),
    surface("cylinder", 7, 7),
    surface("tube", 7, 7),
    surface("cone", 8, 8),
    surface("cup", 8, 8),
    surface("ring", 8, 8),
    surface("source", 4, 4),
    missing("instance", Class::Surface),
    missing("mesh", Class::Surface),
    material("plastic", 5, 5, 0),
    material("metal", 5, 5, 0),
    material("trans", 7, 7, 0),
    material("plastic2", 6, 6, 0),
    material("metal2", 6, 6, 0),
    material("trans2", 8, 8, 0),
    material("glass", 3, 4, 0),
    material("dielectric", 5, 5, 0),
    material("interface", 8, 8, 0),
    material("mirror", 3, 3, 0),
    material("light", 3, 3, 0),
    material("glow", 4, 4, 0),
    material("spotlight", 7, 7, 0),
    material("illum", 3, 3, 0),
    missing("antimatter", Class::Material),
    missing("mist", Class::Material),
    missing("prism1", Class::Material),
    missing("prism2", Class::Material),
    missing("ashik2", Class::Material),
    missing("BRTDfunc", Class::Material),
    missing("WGMDfunc", Class::Material),
    missing("plasfunc", Class::Material),
    missing("metfunc", Class::Material),
    missing("transfunc", Class::Material),
    missing("plasdata", Class::Material),
    missing("metdata", Class::Material),
    missing("transdata", Class::Material),
    missing("BSDF", Class::Material),
    missing("aBSDF", Class::Material),
    Type { name: "brightfunc", class: Class::Pattern, reals: (0, ANY), strings: 2, supported: true },
    missing("colorfunc", Class::Pattern),
    missing("brightdata", Class::Pattern),
    missing("colordata", Class::Pattern),
    missing("colorpict", Class::Pattern),
    missing("brighttext", Class::Pattern),
    missing("colortext", Class::Pattern),
    missing("spectrum", Class::Pattern),
    missing("specfile", Class::Pattern),
    missing("specfunc", Class::Pattern),
    missing("specdata", Class::Pattern),
    missing("specpict", Class::Pattern),
    missing("texfunc", Class::Pattern),
    missing("texdata", Class::Pattern),
    Type { name: "mixfunc", class: Class::Mixture, reals: (0, ANY), strings: 4, supported: true },
    missing("mixdata", Class::Mixture),
    missing("mixpict", Class::Mixture),
    missing("mixtext", Class::Mixture),
];

/// The type of that name.
pub fn find(name: &str) -> Option<&'static Type> {
    TYPES.iter().find(|t| t.name == name)
}

impl Type {
    /// How many numbers it takes, in words.
    pub fn reals_wanted(&self) -> String {
        match self.reals {
            (a, b) if a == b => format!("{a} numbers"),
            (a, ANY) => format!("at least {a} numbers"),
            (a, b) => format!("{a} or {b} numbers"),
        }
    }
}
