//! Printed results of Hamana 2022 that no declaration contains. The figures are pictures: none of
//! their numbers is known.

/// Voltages of A and B of P, Q, R and S in experiment 1 (table 2), V.
pub(super) const TABLE_2: [(&str, [f64; 2]); 4] = [
    ("P", [28.0, 32.0]),
    ("Q", [20.0, 26.0]),
    ("R", [32.0, 32.0]),
    ("S", [18.0, 24.0]),
];

/// Voltages of A and B in experiment 2 (table 3), V.
pub(super) const TABLE_3: [(&str, [f64; 2]); 4] = [
    ("P", [26.0, 30.0]),
    ("Q", [34.0, 24.0]),
    ("R", [40.0, 36.0]),
    ("S", [18.0, 24.0]),
];

/// p of the comparison of each two-point pattern with one point (table 5), by pattern number.
pub(super) const TABLE_5_P: [f64; 14] = [
    0.007_40, 0.007_93, 0.009_58, 0.020_0, 0.008_54, 0.085_1, 0.054_7, 0.139, 0.038_6, 0.277,
    0.041_7, 0.080_5, 0.038_7, 0.121,
];

/// Thresholds of both points together, r_th·V_max of A and B (table 7), V.
pub(super) const TABLE_7_BOTH_V: [(&str, [f64; 2]); 3] = [
    ("P", [20.0, 25.0]),
    ("Q", [22.0, 22.0]),
    ("S", [22.0, 17.0]),
];

/// RMSE of each trial of P, Q and S with one point and with two (table 8), °.
pub(super) const TABLE_8: [(&str, [[f64; 5]; 2]); 3] = [
    (
        "P",
        [
            [8.40, 19.0, 20.5, 13.5, 26.6],
            [9.00, 11.0, 12.6, 10.6, 10.2],
        ],
    ),
    (
        "Q",
        [
            [9.38, 22.8, 23.6, 24.2, 16.9],
            [17.9, 17.5, 12.0, 22.8, 9.48],
        ],
    ),
    (
        "S",
        [
            [12.1, 14.4, 12.4, 12.1, 21.5],
            [12.1, 15.5, 14.5, 12.6, 15.4],
        ],
    ),
];

/// F and p of the number of points, of the participant, and of their interaction (table 9).
pub(super) const TABLE_9: [[f64; 2]; 3] = [[4.30, 0.048_9], [1.76, 0.193], [1.16, 0.332]];

/// Returns the numbers that `table` prints for participant `name`; `None` if there are none.
pub(super) fn printed_values<const N: usize>(
    table: &[(&str, [f64; N])],
    name: &str,
) -> Option<[f64; N]> {
    let own = table.iter().find(|(printed_name, _)| *printed_name == name);
    own.map(|(_, numbers)| *numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 8 equals the golden file with which the statistics are tested.
    #[test]
    fn table_8_is_that_of_the_golden_file() {
        let golden = include_str!("../../../../tests/golden/hamana2022_table8_rmse.csv");
        let rows = golden.lines().filter(|line| !line.starts_with(['#', 'p']));
        let mut rows = rows.map(|row| row.split(',').collect::<Vec<_>>());
        for (name, [one_point, two]) in TABLE_8 {
            for (one_deg, two) in one_point.into_iter().zip(two) {
                let row = rows.next().unwrap();
                let numbers = [1, 2].map(|at| row[at].parse::<f64>().unwrap());
                assert_eq!((row[0], numbers), (name, [one_deg, two]));
            }
        }
        assert_eq!(rows.next(), None);
    }
}
