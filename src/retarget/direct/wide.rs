//! The same as [`super::map`] with the vectors of the processor at hand. All do the same operations in the same order, without fused
//! multiply-add, so they give the same bits.

use std::mem::MaybeUninit;

use glam::Quat;

use super::{
    super::vectors::Vectors,
    map::{RotationMap, are_tidy, map_each},
};

/// Maps values and appends the results, within the capacity, where the values are unit quaternions, each on the hemisphere of the one
/// before; else appends nothing and says no. All are finite.
pub(super) fn append(
    vectors: Vectors,
    map: &RotationMap,
    before: Quat,
    samples: &[Quat],
    mapped: &mut Vec<Quat>,
) -> bool {
    let free = &mut mapped.spare_capacity_mut()[..samples.len()];
    let is_tidy = map_all(vectors, map, before, samples, free);
    if is_tidy {
        let length = mapped.len() + samples.len();
        #[expect(unsafe_code, reason = "each value is written once, where it stays")]
        // SAFETY: as many values as there are samples were written behind those that were there.
        unsafe {
            mapped.set_len(length);
        }
    }
    is_tidy
}

/// Writes a value for each sample, and says whether the samples are tidy.
fn map_all(
    vectors: Vectors,
    map: &RotationMap,
    before: Quat,
    samples: &[Quat],
    mapped: &mut [MaybeUninit<Quat>],
) -> bool {
    assert_eq!(samples.len(), mapped.len(), "a place for each sample");
    match vectors {
        Vectors::Any => {
            map_each(map, samples, mapped);
            are_tidy(before, samples)
        }
        #[cfg(target_arch = "x86_64")]
        #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
        // SAFETY: a processor has the features of the variant that was detected for it.
        Vectors::Of256Bits => unsafe { x86_64::map_in_256_bits(map, before, samples, mapped) },
        #[cfg(target_arch = "x86_64")]
        #[expect(unsafe_code, reason = "calling a function of a target feature that was detected")]
        // SAFETY: as above.
        Vectors::Of512Bits => unsafe { x86_64::map_in_512_bits(map, before, samples, mapped) },
    }
}

#[cfg(target_arch = "x86_64")]
mod x86_64 {
    use std::arch::x86_64::{
        __m128, __m256, __m512, _CMP_NGT_UQ, _CMP_NLT_UQ, _mm256_add_pd, _mm256_add_ps, _mm256_and_ps,
        _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cvtpd_ps, _mm256_cvtps_pd, _mm256_max_ps, _mm256_min_ps,
        _mm256_movemask_ps, _mm256_mul_pd, _mm256_mul_ps, _mm256_permute_pd, _mm256_permute_ps, _mm256_permute4x64_pd,
        _mm256_set1_epi32, _mm256_set1_ps, _mm256_setr_pd, _mm256_setzero_ps, _mm256_sub_ps, _mm512_abs_ps,
        _mm512_add_pd, _mm512_add_ps, _mm512_cmp_ps_mask, _mm512_cvtpd_ps, _mm512_cvtps_pd, _mm512_max_ps,
        _mm512_min_ps, _mm512_mul_pd, _mm512_mul_ps, _mm512_permute_pd, _mm512_permute_ps, _mm512_permutex_pd,
        _mm512_set1_ps, _mm512_setr_pd, _mm512_setzero_ps, _mm512_sub_ps,
    };

    use std::mem::MaybeUninit;

    use glam::Quat;

    use super::super::map::{self, MAX_SQUARE, MAX_STEP, MIN_SQUARE, RotationMap, map_each};

    /// Two values at once.
    #[target_feature(enable = "avx2")]
    pub(super) fn map_in_256_bits(
        map: &RotationMap,
        before: Quat,
        samples: &[Quat],
        mapped: &mut [MaybeUninit<Quat>],
    ) -> bool {
        let [zero, one, two, three] = map.diagonals.map(|[a, b, c, d]| _mm256_setr_pd(a, b, c, d));
        let absolute = _mm256_castsi256_ps(_mm256_set1_epi32(i32::MAX));
        let (mut step, mut most, mut least) = (_mm256_setzero_ps(), _mm256_set1_ps(1.0), _mm256_set1_ps(1.0));
        let (pairs, rest) = samples.as_chunks::<2>();
        let (mapped_pairs, mapped_rest) = mapped.as_chunks_mut::<2>();
        let mut previous = before;
        for (sample, mapped) in pairs.iter().zip(mapped_pairs) {
            let both: __m256 = bytemuck::cast(*sample);
            let steps = _mm256_sub_ps(both, bytemuck::cast([previous, sample[0]]));
            previous = sample[1];
            step = _mm256_max_ps(_mm256_and_ps(steps, absolute), step);
            let squares = _mm256_mul_ps(both, both);
            let halves = _mm256_add_ps(squares, _mm256_permute_ps::<0b10_11_00_01>(squares));
            let squares = _mm256_add_ps(halves, _mm256_permute_ps::<0b01_00_11_10>(halves));
            most = _mm256_max_ps(squares, most);
            least = _mm256_min_ps(squares, least);
            for (sample, mapped) in sample.iter().zip(mapped) {
                let q = _mm256_cvtps_pd(__m128::from(*sample));
                let swapped = _mm256_permute_pd::<0b0101>(q);
                let turned = _mm256_permute4x64_pd::<0b01_00_11_10>(q);
                let reversed = _mm256_permute4x64_pd::<0b00_01_10_11>(q);
                let first = _mm256_add_pd(_mm256_mul_pd(zero, q), _mm256_mul_pd(one, swapped));
                let second = _mm256_add_pd(_mm256_mul_pd(two, turned), _mm256_mul_pd(three, reversed));
                mapped.write(bytemuck::cast(_mm256_cvtpd_ps(_mm256_add_pd(first, second))));
            }
        }
        map_each(map, rest, mapped_rest);
        let has = |mask: __m256| _mm256_movemask_ps(mask) != 0;
        !has(_mm256_cmp_ps::<_CMP_NLT_UQ>(step, _mm256_set1_ps(MAX_STEP)))
            && !has(_mm256_cmp_ps::<_CMP_NLT_UQ>(most, _mm256_set1_ps(MAX_SQUARE)))
            && !has(_mm256_cmp_ps::<_CMP_NGT_UQ>(least, _mm256_set1_ps(MIN_SQUARE)))
            && map::are_tidy(previous, rest)
    }

    /// Four values at once.
    #[target_feature(enable = "avx2,avx512f")]
    pub(super) fn map_in_512_bits(
        map: &RotationMap,
        before: Quat,
        samples: &[Quat],
        mapped: &mut [MaybeUninit<Quat>],
    ) -> bool {
        let [zero, one, two, three] = map.diagonals.map(|[a, b, c, d]| _mm512_setr_pd(a, b, c, d, a, b, c, d));
        let (mut step, mut most, mut least) = (_mm512_setzero_ps(), _mm512_set1_ps(1.0), _mm512_set1_ps(1.0));
        let (fours, rest) = samples.as_chunks::<4>();
        let (mapped_fours, mapped_rest) = mapped.as_chunks_mut::<4>();
        let mut previous = before;
        for (four, mapped) in fours.iter().zip(mapped_fours) {
            let [a, b, c, d] = *four;
            let all: __m512 = bytemuck::cast(*four);
            let steps = _mm512_abs_ps(_mm512_sub_ps(all, bytemuck::cast([previous, a, b, c])));
            previous = d;
            step = _mm512_max_ps(steps, step);
            let squares = _mm512_mul_ps(all, all);
            let halves = _mm512_add_ps(squares, _mm512_permute_ps::<0b10_11_00_01>(squares));
            let squares = _mm512_add_ps(halves, _mm512_permute_ps::<0b01_00_11_10>(halves));
            most = _mm512_max_ps(squares, most);
            least = _mm512_min_ps(squares, least);
            let mut narrow = [_mm256_setzero_ps(); 2];
            for (narrow, pair) in narrow.iter_mut().zip([[a, b], [c, d]]) {
                let q = _mm512_cvtps_pd(bytemuck::cast(pair));
                let swapped = _mm512_permute_pd::<0b0101_0101>(q);
                let turned = _mm512_permutex_pd::<0b01_00_11_10>(q);
                let reversed = _mm512_permutex_pd::<0b00_01_10_11>(q);
                let first = _mm512_add_pd(_mm512_mul_pd(zero, q), _mm512_mul_pd(one, swapped));
                let second = _mm512_add_pd(_mm512_mul_pd(two, turned), _mm512_mul_pd(three, reversed));
                *narrow = _mm512_cvtpd_ps(_mm512_add_pd(first, second));
            }
            *mapped = bytemuck::cast::<_, [Quat; 4]>(narrow).map(MaybeUninit::new);
        }
        map_each(map, rest, mapped_rest);
        _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(step, _mm512_set1_ps(MAX_STEP)) == 0
            && _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(most, _mm512_set1_ps(MAX_SQUARE)) == 0
            && _mm512_cmp_ps_mask::<_CMP_NGT_UQ>(least, _mm512_set1_ps(MIN_SQUARE)) == 0
            && map::are_tidy(previous, rest)
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
            let mapped = |vectors: Vectors| {
                let mut mapped = Vec::with_capacity(count);
                assert!(append(
                    vectors,
                    &map,
                    samples.first().copied().unwrap_or(Quat::IDENTITY),
                    &samples,
                    &mut mapped
                ));
                mapped
            };
            let plain = mapped(Vectors::Any);
            for (sample, mapped) in samples.iter().zip(&plain) {
                let product = first * sample.as_dquat() * after;
                assert!((product - mapped.as_dquat()).length() < 1e-7, "{mapped} instead of {product}");
            }
            for vectors in kinds() {
                let bits = |values: &[Quat]| -> Vec<[u32; 4]> {
                    values.iter().map(|value| value.to_array().map(f32::to_bits)).collect()
                };
                assert_eq!(bits(&mapped(vectors)), bits(&plain), "{vectors:?}, {count} values");
            }
        }
    }

    fn are_tidy(vectors: Vectors, before: Quat, samples: &[Quat]) -> bool {
        let map = RotationMap::new(DQuat::IDENTITY, DQuat::IDENTITY);
        append(vectors, &map, before, samples, &mut Vec::with_capacity(samples.len()))
    }

    #[test]
    fn what_is_untidy_is_seen_at_every_place() {
        for count in [1, 3, 4, 9, 128] {
            let samples = turning(count);
            for vectors in kinds() {
                assert!(are_tidy(vectors, samples[0], &samples), "{vectors:?}, {count}");
                assert!(!are_tidy(vectors, -samples[0], &samples), "{vectors:?}, {count}: over from the one before");
                for place in 0..count {
                    for untidy in
                        [-samples[place], samples[place] * 1.000_01, samples[place] * 0.999_99, samples[place] * 1e30]
                    {
                        let before = samples[0];
                        let mut samples = samples.clone();
                        samples[place] = untidy;
                        assert!(!are_tidy(vectors, before, &samples), "{vectors:?}, {count}: {untidy} at {place}");
                    }
                }
            }
        }
    }
}
