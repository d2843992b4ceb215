//! Eight floats side by side: portable arrays, and AVX2 registers giving the same bits.
//!
//! The compiler leaves plain loops over `[f32; 8]` in scalar form once they are inlined into the traversal, so the
//! AVX2 operations are written out: 1.6 times the rays per second in a room of a thousand triangles, 1.35 times in a
//! displaced sphere of 82 000. Both forms do the same IEEE operations in the
//! same order, without fused multiply-add.

/// Vector operations, none of them in a closure: closures do not inherit the instruction set of the function they are
/// inlined into.
///
/// Bit i of a mask is lane i. Comparisons with NaN are false.
pub(crate) trait Lanes: Copy {
    fn splat(x: f32) -> Self;
    fn load(x: &[f32; 8]) -> Self;
    fn store(self) -> [f32; 8];
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// The larger; `limit` when either is NaN.
    fn max_or(self, limit: Self) -> Self;
    /// The smaller; `limit` when either is NaN.
    fn min_or(self, limit: Self) -> Self;
    fn at_most(self, other: Self) -> u32;
    /// Lanes where all three are positive or all three negative, and lanes where one is zero.
    fn one_sign(e: [Self; 3]) -> (u32, u32);
    /// Asks for the cache lines of `x`. For children about to be pushed this brought 10 % on 82 000 triangles, 15–20 %
    /// on 1.3 million and nothing in a room.
    #[inline(always)]
    fn prefetch<T>(_x: &T) {}
}

/// Without special instructions.
#[derive(Clone, Copy)]
pub(crate) struct Portable([f32; 8]);

fn mask(f: impl Fn(usize) -> bool) -> u32 {
    (0..8).fold(0, |m, i| m | (u32::from(f(i)) << i))
}

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self.0;
        for (a, b) in out.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        Portable(out)
    }
}

impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Portable([x; 8])
    }

    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Portable(*x)
    }

    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    fn max_or(self, limit: Self) -> Self {
        self.zip(limit, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min_or(self, limit: Self) -> Self {
        self.zip(limit, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        mask(|i| self.0[i] <= other.0[i])
    }

    #[inline(always)]
    fn one_sign(e: [Self; 3]) -> (u32, u32) {
        let all = |f: fn(f32) -> bool| mask(|i| f(e[0].0[i]) & f(e[1].0[i]) & f(e[2].0[i]));
        let zero = mask(|i| (e[0].0[i] == 0.0) | (e[1].0[i] == 0.0) | (e[2].0[i] == 0.0));
        (all(|x| x > 0.0) | all(|x| x < 0.0), zero)
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;

    use super::Lanes;

    /// AVX2 registers. Only functions with `#[target_feature(enable = "avx2")]` may name this type as their lanes:
    /// every operation is inlined into one of those.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256);

    impl Lanes for Avx2 {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: the processor has AVX2, see the type.
            Avx2(unsafe { _mm256_set1_ps(x) })
        }

        #[inline(always)]
        fn load(x: &[f32; 8]) -> Self {
            // SAFETY: the processor has AVX2, see the type; the array is 32 readable bytes, of any alignment.
            Avx2(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }

        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: the processor has AVX2, see the type; the array is 32 writable bytes, of any alignment.
            unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: the processor has AVX2, see the type.
            Avx2(unsafe { _mm256_sub_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: the processor has AVX2, see the type.
            Avx2(unsafe { _mm256_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn max_or(self, limit: Self) -> Self {
            // SAFETY: the processor has AVX2, see the type.
            Avx2(unsafe { _mm256_max_ps(self.0, limit.0) })
        }

        #[inline(always)]
        fn min_or(self, limit: Self) -> Self {
            // SAFETY: the processor has AVX2, see the type.
            Avx2(unsafe { _mm256_min_ps(self.0, limit.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            // SAFETY: the processor has AVX2, see the type.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }

        #[inline(always)]
        fn prefetch<T>(x: &T) {
            for offset in (0..size_of::<T>()).step_by(64) {
                // SAFETY: a prefetch accesses nothing; the pointer stays inside `x`.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(x).cast::<i8>().add(offset)) };
            }
        }

        #[inline(always)]
        fn one_sign(e: [Self; 3]) -> (u32, u32) {
            // SAFETY: the processor has AVX2, see the type.
            unsafe {
                let none = _mm256_setzero_ps();
                let [Avx2(a), Avx2(b), Avx2(c)] = e;
                let positive = _mm256_and_ps(
                    _mm256_and_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(a, none), _mm256_cmp_ps::<_CMP_GT_OQ>(b, none)),
                    _mm256_cmp_ps::<_CMP_GT_OQ>(c, none),
                );
                let negative = _mm256_and_ps(
                    _mm256_and_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, none), _mm256_cmp_ps::<_CMP_LT_OQ>(b, none)),
                    _mm256_cmp_ps::<_CMP_LT_OQ>(c, none),
                );
                let zero = _mm256_or_ps(
                    _mm256_or_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(a, none), _mm256_cmp_ps::<_CMP_EQ_OQ>(b, none)),
                    _mm256_cmp_ps::<_CMP_EQ_OQ>(c, none),
                );
                (_mm256_movemask_ps(_mm256_or_ps(positive, negative)) as u32, _mm256_movemask_ps(zero) as u32)
            }
        }
    }
}
