//! Which vectors the processor has.
//!
//! What takes long is compiled for each of them. All do the same operations in the same order, without fused multiply-add, so they
//! give the same bits.

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
}
