//! log2 of C + 1, from log2 of C, for the pulse that adds 1 to C.

use crate::arithmetic::polynomial::horner;

/// Function log2(1 + 2^−y) for y in r…r + 1, one row for each r: a polynomial in y − r − 1/2, Q30,
/// highest power first, through the function at six Chebyshev nodes. The error is within 2.3e-8.
/// Beyond the last row the function is below 1.4e-6 and counts as 0.
#[rustfmt::skip]
const LOGARITHMS: [[i32; 6]; 20] = [
    [161_599, -1_631_033, -3_579_153, 90_292_432, -444_758_430, 828_449_073],
    [248_162, -459_285, -7_924_087, 71_812_923, -280_465_528, 468_958_662],
    [98_715, 435_260, -7_678_268, 47_505_154, -161_298_682, 252_158_141],
    [-12_691, 610_182, -5_373_521, 27_766_951, -87_198_898, 131_204_177],
    [-39_081, 456_954, -3_190_024, 15_083_359, -45_444_740, 66_990_768],
    [-31_170, 275_942, -1_740_020, 7_871_219, -23_213_613, 33_857_487],
    [-19_041, 151_261, -908_996, 4_022_070, -11_733_644, 17_021_243],
    [-10_462, 79_148, -464_610, 2_033_186, -5_899_054, 8_534_000],
    [-5_477, 40_479, -234_880, 1_022_199, -2_957_651, 4_272_877],
    [-2_801, 20_469, -118_090, 512_510, -1_480_865, 2_137_912],
    [-1_416, 10_292, -59_208, 256_609, -740_944, 1_069_325],
    [-712, 5_161, -29_645, 128_393, -370_600, 534_755],
    [-357, 2_584, -14_833, 64_219, -185_332, 267_400],
    [-179, 1_293, -7_419, 32_115, -92_674, 133_706],
    [-89, 647, -3_710, 16_059, -46_339, 66_854],
    [-45, 323, -1_855, 8_030, -23_170, 33_428],
    [-22, 162, -928, 4_015, -11_585, 16_714],
    [-11, 81, -464, 2_008, -5_793, 8_357],
    [-6, 40, -232, 1_004, -2_896, 4_178],
    [-3, 20, -116, 502, -1_448, 2_089],
];

/// Returns log2 of 32/(C + 1) in 2^-27 from log2 of 32/C in 2^-22.
///
/// With y = |log2 C|, C + 1 is 2^y·(1 + 2^−y) for C above 1, and 1 + 2^−y below.
#[inline(always)]
pub(super) fn octaves_of_sum(octaves: u32) -> u32 {
    // log2 C in 2^-22: −251…5.
    let log = (5 << 22) - octaves.cast_signed();
    let y = log.unsigned_abs();
    let over = match LOGARITHMS.get((y >> 22) as usize) {
        Some(row) => horner(row, ((y << 10) ^ 1 << 31).cast_signed()) >> 3,
        None => 0,
    };
    // At least log2(32/33), and less than 5.
    let above = log.max(0) << 5;
    ((5 << 27) - above - over).max(0).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_adds_one_to_calcium() {
        let mut worst = 0f64;
        for n in 0..200_000u32 {
            let octaves = n * 1_049; // up to 50 octaves in 2^-22
            let calcium = 32.0 * (-f64::from(octaves) / 4_194_304.0).exp2();
            let sum = 32.0 * (-f64::from(octaves_of_sum(octaves)) / 134_217_728.0).exp2();
            // At most log2(32/33) below 0, where the result saturates.
            let exact = (calcium + 1.0).min(32.0);
            worst = worst.max((sum / exact - 1.0).abs());
        }
        std::println!("log2 of a sum: {worst:e}");
        assert!((4e-7..1.2e-6).contains(&worst), "{worst:e}");
    }
}
