//! Which vectors the processor has.
//!
//! What takes long is compiled for each of them. All do the same operations in the same order, without fused multiply-add, so they
//! give the same bits.

/// What is compiled for each kind of vectors. It has to be inlined, and all that it calls in its loops.
pub(super) trait Vectorized {
    fn run(self);
}

/// What the processor can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Vectors {
    /// Nothing that is known of.
    Any,
    #[cfg(target_arch = "x86_64")]
    Of256Bits,
    #[cfg(target_arch = "x86_64")]
    Of512Bits,
}

impl Vectors {
    pub(super) fn detected() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx2") && has!("avx512f") && has!("avx512dq") && has!("avx512vl") {
                return Self::Of512Bits;
            }
            if has!("avx2") {
                return Self::Of256Bits;
            }
        }
        Self::Any
    }

    /// Runs what was compiled for these vectors.
    pub(super) fn run(self, work: impl Vectorized) {
        match self {
            Self::Any => work.run(),
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
            // SAFETY: a processor has the features of the variant that was detected for it.
            Self::Of256Bits => unsafe { run_with_256_bits(work) },
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
            // SAFETY: as above.
            Self::Of512Bits => unsafe { run_with_512_bits(work) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_with_256_bits(work: impl Vectorized) {
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
fn run_with_512_bits(work: impl Vectorized) {
    work.run();
}
