//! Deliberate mistakes, for seeing that the tests and `hemilux validate` notice them. Only with the cargo feature
//! `wrong-physics`, which is never in a shipped program; without it nothing is ever wrong, at no cost.

/// One mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// None.
    Nothing = 0,
    /// The cosine at the luminaire is left out where areas become solid angles.
    Cosine = 1,
    /// Metals and mirrors reflect 0.9 of what they should.
    Mirrors = 2,
    /// Dielectrics reflect as for s-polarised light.
    Fresnel = 3,
    /// Cones and predicted field radiance count as 0.9 of their density where strata are balanced.
    Density = 4,
}

impl Wrong {
    /// Every mistake by name.
    pub const ALL: [(&'static str, Wrong); 4] = [
        ("cosine", Wrong::Cosine),
        ("mirrors", Wrong::Mirrors),
        ("fresnel", Wrong::Fresnel),
        ("density", Wrong::Density),
    ];
}

#[cfg(feature = "wrong-physics")]
static CHOSEN: std::sync::atomic::AtomicU8 = std::sync::atomic::AtomicU8::new(0);

/// Make `wrong`, from now on, everywhere.
#[cfg(feature = "wrong-physics")]
pub fn choose(wrong: Wrong) {
    CHOSEN.store(wrong as u8, std::sync::atomic::Ordering::SeqCst);
}

/// Whether `wrong` is being made.
#[inline(always)]
#[cfg(feature = "wrong-physics")]
pub fn makes(wrong: Wrong) -> bool {
    CHOSEN.load(std::sync::atomic::Ordering::Relaxed) == wrong as u8
}

/// Whether `wrong` is being made: never.
#[inline(always)]
#[cfg(not(feature = "wrong-physics"))]
pub fn makes(_: Wrong) -> bool {
    false
}
