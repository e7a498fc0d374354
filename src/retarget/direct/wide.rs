//! The same as [`super::map`] with the vectors of the processor at hand. All do the same operations in the same order, without fused
//! multiply-add, so they give the same bits.

use glam::Quat;

use super::map::{RotationMap, are_tidy, map_each};

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
            if std::arch::is_x86_feature_detected!("avx512f") && std::arch::is_x86_feature_detected!("avx2") {
                return Self::Of512Bits;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Of256Bits;
            }
        }
        Self::Any
    }

    /// Whether values, which are finite, are unit quaternions, each on the hemisphere of the one before.
    pub(super) fn are_tidy(self, before: Quat, samples: &[Quat]) -> bool {
        match self {
            Self::Any => are_tidy(before, samples),
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
            // SAFETY: a processor has the features of the variant that was detected for it.
            Self::Of256Bits | Self::Of512Bits => unsafe { x86_64::are_tidy(before, samples) },
        }
    }

    /// Maps as many values as both have.
    pub(super) fn map(self, map: &RotationMap, samples: &[Quat], mapped: &mut [Quat]) {
        match self {
            Self::Any => map_each(map, samples, mapped),
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
            // SAFETY: as above.
            Self::Of256Bits => unsafe { x86_64::map_singly(map, samples, mapped) },
            #[cfg(target_arch = "x86_64")]
            #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
            // SAFETY: as above.
            Self::Of512Bits => unsafe { x86_64::map_in_pairs(map, samples, mapped) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use std::arch::x86_64::{
        __m128, __m256, _CMP_NGT_UQ, _CMP_NLT_UQ, _mm256_add_pd, _mm256_add_ps, _mm256_and_ps, _mm256_castps256_ps128,
        _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cvtpd_ps, _mm256_cvtps_pd, _mm256_extractf128_ps, _mm256_max_ps,
        _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_pd, _mm256_mul_ps, _mm256_permute_pd, _mm256_permute_ps,
        _mm256_permute4x64_pd, _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_pd, _mm256_setzero_ps, _mm256_shuffle_ps,
        _mm256_sub_ps, _mm512_add_pd, _mm512_cvtpd_ps, _mm512_cvtps_pd, _mm512_mul_pd, _mm512_permute_pd,
        _mm512_permutex_pd, _mm512_setr_pd,
    };

    use glam::{Quat, Vec4};

    use super::super::map::{self, MAX_SQUARE, MAX_STEP, MIN_SQUARE, RotationMap, map_each};

    #[target_feature(enable = "avx2")]
    pub(super) fn are_tidy(before: Quat, samples: &[Quat]) -> bool {
        let (fours, rest) = samples.as_chunks::<4>();
        let absolute = _mm256_castsi256_ps(_mm256_set1_epi32(i32::MAX));
        let (mut step, mut most, mut least) = (_mm256_setzero_ps(), _mm256_set1_ps(1.0), _mm256_set1_ps(1.0));
        let mut previous = before;
        for [a, b, c, d] in fours {
            let (first, second) = (pair(*a, *b), pair(*c, *d));
            let steps = [_mm256_sub_ps(first, pair(previous, *a)), _mm256_sub_ps(second, pair(*b, *c))];
            previous = *d;
            step = _mm256_max_ps(_mm256_and_ps(steps[0], absolute), step);
            step = _mm256_max_ps(_mm256_and_ps(steps[1], absolute), step);
            let (first, second) = (_mm256_mul_ps(first, first), _mm256_mul_ps(second, second));
            let even = _mm256_shuffle_ps::<0b10_00_10_00>(first, second);
            let odd = _mm256_shuffle_ps::<0b11_01_11_01>(first, second);
            let halves = _mm256_add_ps(even, odd);
            let squares = _mm256_add_ps(halves, _mm256_permute_ps::<0b10_11_00_01>(halves));
            most = _mm256_max_ps(squares, most);
            least = _mm256_min_ps(squares, least);
        }
        let has = |mask: __m256| _mm256_movemask_ps(mask) != 0;
        !has(_mm256_cmp_ps::<_CMP_NLT_UQ>(step, _mm256_set1_ps(MAX_STEP)))
            && !has(_mm256_cmp_ps::<_CMP_NLT_UQ>(most, _mm256_set1_ps(MAX_SQUARE)))
            && !has(_mm256_cmp_ps::<_CMP_NGT_UQ>(least, _mm256_set1_ps(MIN_SQUARE)))
            && map::are_tidy(previous, rest)
    }

    #[target_feature(enable = "avx2")]
    fn pair(first: Quat, second: Quat) -> __m256 {
        bytemuck::cast([first, second])
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn map_singly(map: &RotationMap, samples: &[Quat], mapped: &mut [Quat]) {
        let [zero, one, two, three] = map.diagonals.map(|[a, b, c, d]| _mm256_setr_pd(a, b, c, d));
        for (sample, mapped) in samples.iter().zip(mapped) {
            let q = _mm256_cvtps_pd(__m128::from(*sample));
            let swapped = _mm256_permute_pd::<0b0101>(q);
            let turned = _mm256_permute4x64_pd::<0b01_00_11_10>(q);
            let reversed = _mm256_permute4x64_pd::<0b00_01_10_11>(q);
            let first = _mm256_add_pd(_mm256_mul_pd(zero, q), _mm256_mul_pd(one, swapped));
            let second = _mm256_add_pd(_mm256_mul_pd(two, turned), _mm256_mul_pd(three, reversed));
            *mapped = Quat::from_vec4(Vec4::from(_mm256_cvtpd_ps(_mm256_add_pd(first, second))));
        }
    }

    #[target_feature(enable = "avx2,avx512f")]
    pub(super) fn map_in_pairs(map: &RotationMap, samples: &[Quat], mapped: &mut [Quat]) {
        let [zero, one, two, three] = map.diagonals.map(|[a, b, c, d]| _mm512_setr_pd(a, b, c, d, a, b, c, d));
        let (pairs, rest) = samples.as_chunks::<2>();
        let (mapped_pairs, mapped_rest) = mapped.as_chunks_mut::<2>();
        for ([first, second], mapped) in pairs.iter().zip(mapped_pairs) {
            let q = _mm512_cvtps_pd(pair(*first, *second));
            let swapped = _mm512_permute_pd::<0b0101_0101>(q);
            let turned = _mm512_permutex_pd::<0b01_00_11_10>(q);
            let reversed = _mm512_permutex_pd::<0b00_01_10_11>(q);
            let first = _mm512_add_pd(_mm512_mul_pd(zero, q), _mm512_mul_pd(one, swapped));
            let second = _mm512_add_pd(_mm512_mul_pd(two, turned), _mm512_mul_pd(three, reversed));
            let narrow = _mm512_cvtpd_ps(_mm512_add_pd(first, second));
            mapped[0] = Quat::from_vec4(Vec4::from(_mm256_castps256_ps128(narrow)));
            mapped[1] = Quat::from_vec4(Vec4::from(_mm256_extractf128_ps::<1>(narrow)));
        }
        map_each(map, rest, mapped_rest);
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;

    fn kinds() -> Vec<Vectors> {
        match Vectors::detected() {
            #[cfg(target_arch = "x86_64")]
            Vectors::Of512Bits => vec![Vectors::Any, Vectors::Of256Bits, Vectors::Of512Bits],
            Vectors::Any => vec![Vectors::Any],
            #[cfg(target_arch = "x86_64")]
            Vectors::Of256Bits => vec![Vectors::Any, Vectors::Of256Bits],
        }
    }

    fn turning(count: usize) -> Vec<Quat> {
        let turn = |frame: usize| {
            let angle = frame as f64 * 0.1;
            DQuat::from_scaled_axis(DVec3::new(angle.sin(), (angle * 1.7).cos(), angle * 0.3)).as_quat()
        };
        (0..count).map(turn).collect()
    }

    #[test]
    fn all_vectors_give_the_product_and_the_same_bits() {
        let (first, after) = (DQuat::from_rotation_x(0.7), DQuat::from_euler(glam::EulerRot::ZYX, 0.2, -1.4, 2.0));
        let map = RotationMap::new(first, after);
        for count in [0, 1, 2, 7, 128, 131] {
            let samples = turning(count);
            let mut plain = vec![Quat::IDENTITY; count];
            Vectors::Any.map(&map, &samples, &mut plain);
            for (sample, mapped) in samples.iter().zip(&plain) {
                let product = first * sample.as_dquat() * after;
                assert!((product - mapped.as_dquat()).length() < 1e-7, "{mapped} instead of {product}");
            }
            for vectors in kinds() {
                let mut mapped = vec![Quat::IDENTITY; count];
                vectors.map(&map, &samples, &mut mapped);
                let bits = |values: &[Quat]| -> Vec<[u32; 4]> {
                    values.iter().map(|value| value.to_array().map(f32::to_bits)).collect()
                };
                assert_eq!(bits(&mapped), bits(&plain), "{vectors:?}, {count} values");
            }
        }
    }

    #[test]
    fn what_is_untidy_is_seen_at_every_place() {
        for count in [1, 3, 4, 9, 128] {
            let samples = turning(count);
            for vectors in kinds() {
                assert!(vectors.are_tidy(samples[0], &samples), "{vectors:?}, {count}");
                assert!(!vectors.are_tidy(-samples[0], &samples), "{vectors:?}, {count}: over from the one before");
                for place in 0..count {
                    for untidy in
                        [-samples[place], samples[place] * 1.000_01, samples[place] * 0.999_99, samples[place] * 1e30]
                    {
                        let before = samples[0];
                        let mut samples = samples.clone();
                        samples[place] = untidy;
                        assert!(!vectors.are_tidy(before, &samples), "{vectors:?}, {count}: {untidy} at {place}");
                    }
                }
            }
        }
    }
}
