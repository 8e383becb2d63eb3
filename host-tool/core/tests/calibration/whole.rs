//! Whole calibrations of ten electrodes, compared with their true values.

use super::scene::*;
use hal_sim::body::Array;
use hal_sim::body::array::MOVEMENTS;
use hal_sim::body::bench::SensorSpec;
use host_core::calibration::{
    Auto, CalibrationError, HOST_TIMEOUT_MS, OnDisk, Operator, OperatorLoss, Order, View,
};
use host_core::wearer::{Evidence, Wearer};

/// Returns the lowest step whose force exceeds 60 mN, which the instrument can distinguish from its
/// noise.
fn true_threshold_ma(body: &Array, index: usize) -> f64 {
    let near = body.points()[index].reaches[0];
    let is_told = |ma: f64| near.pool.share(ma) * near.full_n > 0.06;
    let mut ma = 0.5 * (near.pool.lowest() / 0.5).floor();
    while !is_told(ma) {
        ma += 0.5;
    }
    ma
}

#[test]
fn ten_electrodes_are_found_in_a_quarter_of_an_hour() {
    let out = folder("ten").join("w.toml");
    let (found, spent, text) = run_whole_calibration(&plan_with_electrodes(10), &out);
    println!(
        "{:.1} min of device time, {} presentations",
        spent.t_s / 60.0,
        spent.given
    );
    assert!(spent.t_s <= 900.0, "{}", spent.t_s);
    let body = Array::new(SEED, SensorSpec::default()).unwrap();
    for (index, found) in found.iter().enumerate() {
        let (point, truth) = (body.points()[index], true_threshold_ma(&body, index));
        let threshold = found.threshold.unwrap().units();
        println!(
            "channel {}: threshold {threshold} (truth {truth}, first fibre {:.2}), limit {} \
             (bears {:.2}), {:?}",
            index + 1,
            point.reaches[0].pool.lowest(),
            found.limit.unwrap(),
            point.bears_ma,
            found.moves,
        );
        assert!((threshold - truth).abs() <= 0.5, "{threshold} {truth}");
        let limit = found.limit.unwrap().units();
        assert!(limit <= point.bears_ma && point.bears_ma < limit + 0.5);
        let moves = found.moves.as_ref().unwrap();
        assert!(moves.contains(&MOVEMENTS[point.reaches[0].movement].to_owned()));
    }
    let wearer = Wearer::parse("w.toml", &text).unwrap();
    assert_eq!(wearer.electrodes.len(), 10);
    assert_eq!(wearer.history.len(), 10);
    assert_eq!(wearer.evidence, Evidence::Simulated);
    assert!(wearer.limits.host_timeout_ms <= HOST_TIMEOUT_MS && wearer.limits.fall_ms <= 50);
}

/// 200 searches on 20 arms; a threshold below that of the first fibre is false.
#[test]
fn thresholds_are_seldom_false_and_mostly_within_a_step() {
    let (mut searches, mut is_false, mut is_near) = (0, 0, 0);
    for seed in 1..=20 {
        let order = plan_with_electrodes(10);
        let out = folder(&format!("seed{seed}")).join("w.toml");
        let port = array_port(&order.0, seed, SensorSpec::default());
        let (found, _, _) = run_calibration(port, &order, &out, &OnDisk, &mut Auto);
        let body = Array::new(seed, SensorSpec::default()).unwrap();
        for (index, found) in found.unwrap().iter().enumerate() {
            let threshold = found.threshold.unwrap().units();
            let truth = true_threshold_ma(&body, index);
            searches += 1;
            is_false += usize::from(threshold < body.points()[index].reaches[0].pool.lowest());
            is_near += usize::from((threshold - truth).abs() <= 0.5);
        }
    }
    println!("{searches} searches: {is_false} false, {is_near} within a step");
    assert!(is_false * 100 < searches, "{is_false}");
    assert!(is_near * 100 >= 95 * searches, "{is_near}");
}

/// Orders one raise and nothing after that.
struct Once(bool);

impl Operator for Once {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        if view.t_s > 30.0 {
            return Err(OperatorLoss::Ended);
        }
        let is_first = !std::mem::replace(&mut self.0, true);
        Ok(is_first.then_some(Order::Raise).into_iter().collect())
    }
}

#[test]
fn silence_raises_nothing() {
    let order = plan_with_electrodes(1);
    let out = folder("silence").join("w.toml");
    let port = array_port(&order.0, SEED, SensorSpec::default());
    let (result, spent, port) = run_calibration(port, &order, &out, &OnDisk, &mut Once(false));
    let message = result.unwrap_err().to_string();
    assert!(
        message.starts_with("E684 the calibration ended"),
        "{message}"
    );
    assert_eq!(spent.given, 1);
    let mut port = port.unwrap();
    // The level rises, lasts a second and falls; in the following half minute there is no pulse of
    // any size.
    let end_us = port.world.now_us();
    assert!(driven_after(&port.world, 2_000_000).is_none());
    silent_after(&mut port.world, end_us);
}

#[test]
fn a_sensor_that_saturates_or_hangs_upside_down_is_named() {
    for (name, sensor) in [
        (
            "E680 ",
            SensorSpec {
                range_n: 0.5,
                ..SensorSpec::default()
            },
        ),
        (
            "E681 ",
            SensorSpec {
                is_upside_down: true,
                ..SensorSpec::default()
            },
        ),
    ] {
        let order = plan_with_electrodes(2);
        let out = folder(name.trim()).join("w.toml");
        let port = array_port(&order.0, SEED, sensor);
        let (result, _, port) = run_calibration(port, &order, &out, &OnDisk, &mut Auto);
        let error = result.unwrap_err();
        assert!(error.to_string().starts_with(name), "{error}");
        assert!(matches!(
            error,
            CalibrationError::Saturates(_) | CalibrationError::UpsideDown(_)
        ));
        let mut port = port.unwrap();
        let end_us = port.world.now_us();
        silent_after(&mut port.world, end_us);
        assert!(entries(&out).len() > 2);
    }
}
