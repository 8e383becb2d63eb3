//! Tests that rows are unchanged after packing and unpacking.

use super::*;
use hal_sim::random::Random;

fn value(random: &mut Random) -> Cell {
    match random.below(6) {
        0 => None,
        1 => Some(random.unit() - 0.5),
        2 => Some([0.0, -0.0, 1e300, -1e16, f64::INFINITY][random.below(5) as usize]),
        _ => Some(random.below(20_000) as f64 / 1e3 - 10.0),
    }
}

fn row(random: &mut Random, n: u32) -> Sample {
    let mut list = |most: u64| {
        let count = match random.below(50) {
            0 => random.below(most + 1),
            _ => most,
        };
        (0..count).map(|_| value(random)).collect::<Vec<_>>()
    };
    let [amplitudes, widths_us, forces_n, wanted_n] = [10, 1, 2, 2].map(&mut list);
    let [rates_hz, below_n, above_n, joint_deg, phase] = [2, 0, 1, 3, 3].map(&mut list);
    let [hand_n, hand_true_n] = [3, 3].map(&mut list);
    Sample {
        t_s: f64::from(n) / 100.0,
        target_deg: value(random),
        measured_deg: value(random),
        true_deg: value(random),
        effort: value(random),
        limiting: random.below(2) == 1,
        state: STATES[random.below(6) as usize],
        amplitudes,
        widths_us,
        forces_n,
        wanted_n,
        rates_hz,
        below_n,
        above_n,
        hand_n,
        hand_made: value(random),
        hand_true_n,
        held: value(random),
        joint_deg,
        phase,
    }
}

#[test]
fn rows_come_out_as_they_went_in() {
    let mut random = Random::new(42);
    let rows: Vec<Sample> = (0..2_000).map(|n| row(&mut random, n)).collect();
    let mut samples = Samples::from(rows.clone());
    // Compared bit for bit, because -0 equals 0 otherwise.
    assert_eq!(format!("{:?}", samples.to_vec()), format!("{rows:?}"));
    assert_eq!((samples.len(), samples.iter().len()), (2_000, 2_000));
    assert_eq!(samples.first().as_ref(), rows.first());
    assert_eq!(samples.last(), rows.last());
    samples.truncate(7);
    assert_eq!(samples.to_vec(), rows[..7]);
    samples.push(rows[9].clone());
    assert_eq!(samples.iter().last().as_ref(), Some(&rows[9]));
    let read: Samples = serde_json::from_str("[]").unwrap();
    assert!(read.is_empty() && read.first().is_none());
}

/// Samples that are decoded ahead read as before, and only while they fit the memory.
#[test]
fn rows_decoded_ahead_are_the_same() {
    let mut random = Random::new(43);
    let rows: Vec<Sample> = (0..500).map(|n| row(&mut random, n)).collect();
    let mut samples = Samples::from(rows.clone());
    let read = |samples: &Samples| -> Vec<String> {
        samples.map_each(|sample| format!("{sample:?}")).collect()
    };
    let streamed = read(&samples);
    assert_eq!(samples.decode_ahead(500 * size_of::<Sample>()), 0);
    assert!(samples.decoded.is_empty());
    let taken = samples.decode_ahead(1 << 20);
    assert!(taken > 500 * size_of::<Sample>() && samples.decoded.len() == 500);
    assert_eq!(read(&samples), streamed);
    assert_eq!(format!("{:?}", samples.to_vec()), format!("{rows:?}"));
    samples.push(rows[3].clone());
    assert!(samples.decoded.is_empty());
    assert_eq!(read(&samples).last(), Some(&streamed[3]));
}

#[test]
fn a_day_takes_tens_of_megabytes() {
    let mut samples = Samples::default();
    for n in 0..100_000u32 {
        samples.push(Sample {
            t_s: f64::from(n) / 100.0 + 0.000_321,
            state: DeviceState::Stimulating,
            amplitudes: vec![Some(f64::from(n / 1_000) / 1e3)],
            ..Sample::default()
        });
    }
    let bytes = samples.bytes.len() / samples.len();
    assert!(bytes <= 6, "{bytes} bytes a row");
}
