//! Tests of the muscle model's integrators: orders of convergence, reading without side effects,
//! return to rest.
//!
//! Their errors against an independent solution are tested in tests/tests/accuracy.rs.

use firmware::muscle::CalciumForceSpec;
use firmware::units::Micros;
use methods::muscle::{Integrator, Method, Number, Setting};

/// Subject K05 of Lee 2020, table 4: the fastest muscle, the smallest K.
const K05: CalciumForceSpec = CalciumForceSpec {
    a_mn_per_s: 130_800,
    k_micro: 12_000,
    tau_c_us: 11_500,
    tau1_us: 5_000,
    tau2_us: 124_100,
};

/// Pulse times, no two at the same distance from the beginning of a step.
const PULSES_US: [u32; 12] = [
    3_137, 26_411, 55_873, 80_009, 104_999, 133_500, 150_001, 181_234, 181_999, 205_050, 231_777,
    256_123,
];

fn setting(method: Method, step_us: u32) -> Setting {
    Setting::new(method, Number::F64, step_us)
}

fn planned(method: Method, step_us: u32) -> Setting {
    Setting::planned(method, Number::F64, step_us)
}

/// Returns the force at 320 ms, N, after readings every `output_us`.
fn run(muscle: &mut dyn Integrator, output_us: u32) -> f64 {
    let mut pulses = PULSES_US.into_iter().peekable();
    for at in (output_us..=320_000).step_by(output_us as usize) {
        while let Some(pulse) = pulses.next_if(|us| *us <= at) {
            muscle.pulse(Micros::new(pulse));
        }
        muscle.advance(Micros::new(at));
        let _ = (muscle.force_n(), muscle.calcium());
    }
    muscle.force_n()
}

fn force(setting: Setting, output_us: u32) -> f64 {
    setting
        .with_integrator(&K05, |muscle| run(muscle, output_us))
        .unwrap()
}

/// Returns the force with four nodes over at most 10 ms, whose error is 6e-9 % of the peak.
fn exact() -> f64 {
    force(setting(Method::EventDriven4, 10_000), 320_000)
}

#[test]
fn halving_the_step_divides_the_error_by_two_to_the_order() {
    for (method, order) in [
        (Method::Euler, 1),
        (Method::Heun, 2),
        (Method::RungeKutta4, 4),
        (Method::EulerExactC, 1),
        (Method::HeunExactC, 2),
        (Method::RungeKutta4ExactC, 4),
        (Method::HermiteSimpson, 4),
        (Method::Etd1, 1),
        (Method::EtdMidpoint, 2),
        (Method::GaussExponential, 4),
        (Method::RosenbrockEuler, 2),
        (Method::Rosenbrock3, 3),
    ] {
        let error = |us| (force(setting(method, us), 320_000) - exact()).abs();
        let ratio = error(1000) / error(500);
        let found = ratio.log2();
        println!("{}: order {found:.2}", method.name());
        assert!(
            (found - f64::from(order)).abs() < 0.25,
            "{} {found}",
            method.name()
        );
    }
}

/// Whole steps read through their cubics at many times keep the order of the method, up to that of
/// the cubic. The test sums many errors, because they may cancel at a single time.
#[test]
fn a_cubic_keeps_the_order() {
    let forces = |setting: Setting| {
        let force_course = |muscle: &mut dyn Integrator| {
            let mut pulses = PULSES_US.into_iter().peekable();
            let read = |at| {
                while let Some(pulse) = pulses.next_if(|us| *us <= at) {
                    muscle.pulse(Micros::new(pulse));
                }
                muscle.advance(Micros::new(at));
                muscle.force_n()
            };
            (100..=320_000).step_by(100).map(read).collect::<Vec<f64>>()
        };
        setting.with_integrator(&K05, force_course).unwrap()
    };
    let exact = forces(setting(Method::EventDriven4, 10_000));
    for (method, order) in [
        (Method::EulerExactC, 1),
        (Method::HeunExactC, 2),
        (Method::RungeKutta4ExactC, 4),
        (Method::HermiteSimpson, 4),
        (Method::Etd1, 1),
        (Method::EtdMidpoint, 2),
        (Method::GaussExponential, 4),
        (Method::RosenbrockEuler, 2),
        (Method::Rosenbrock3, 3),
    ] {
        let error = |us| {
            let forces = forces(planned(method, us)).into_iter().zip(&exact);
            forces.map(|(f, exact)| (f - exact).abs()).sum::<f64>()
        };
        // The order of `exprb32` shows at shorter steps only.
        let longest = if order == 3 { 500 } else { 2000 };
        let found = (error(longest) / error(longest / 2)).log2();
        println!("{}: order {found:.2}", method.name());
        let is_kept = (found - f64::from(order)).abs() < 0.25;
        assert!(is_kept, "{} {found}", method.name());
    }
}

/// Without readings in between, a method on demand takes the steps that a planned one takes. Both then
/// differ by the cubic of the steps that pulses cut.
#[test]
fn steps_on_demand_keep_the_order() {
    for (method, order) in [
        (Method::HermiteSimpson, 4),
        (Method::GaussExponential, 4),
        (Method::Rosenbrock3, 3),
        (Method::EtdMidpoint, 2),
    ] {
        let setting = |us| Setting::on_demand(method, Number::F64, us);
        let error = |us| (force(setting(us), 320_000) - exact()).abs();
        let found = (error(1000) / error(500)).log2();
        println!("{}: order {found:.2}", method.name());
        assert!((found - f64::from(order)).abs() < 0.3, "{method:?} {found}");
    }
}

/// The device's formats add rounding errors only: below 3e-6 of the peak, whatever the step.
#[test]
fn the_formats_of_the_device_add_only_rounding() {
    let mut worst = 0f64;
    for method in Setting::IN_DEVICE_FORMATS {
        for step_us in [2000, 4000, 8000] {
            for make in [Setting::planned, Setting::on_demand] {
                for output_us in [1000, 20_000] {
                    let forces = [Number::F64, Number::Device]
                        .map(|number| force(make(method, number, step_us), output_us));
                    let off = (forces[0] / forces[1] - 1.0).abs();
                    println!("{} {step_us}: {off:.1e}", method.name());
                    worst = worst.max(off);
                }
            }
        }
    }
    assert!((1e-9..3e-6).contains(&worst), "{worst:e}");
}

#[test]
fn event_driven_methods_may_be_read_at_any_time() {
    for (method, step_us) in [
        (Method::EventDriven3, Setting::WHOLE_US),
        (Method::LogFlow, Setting::WHOLE_US),
    ] {
        let [often, once] = [1000, 320_000].map(|us| force(setting(method, step_us), us));
        assert!(
            (often - once).abs() < 1e-9 * once,
            "{} {often} {once}",
            method.name()
        );
    }
}

/// The test waits ten seconds in floating point, with frequent and with rare readings. (The
/// remainder in fixed point depends on word length and rounding.)
#[test]
fn a_muscle_without_pulses_comes_to_rest() {
    let is_floating = |n| matches!(n, Number::F64 | Number::F32 | Number::Micromath);
    // τ1 of K05 is 5 ms: an explicit method with a step beyond 2 or 2.785 times that diverges.
    let is_stable = |s: &Setting| match s.method {
        Method::EulerExactC | Method::HeunExactC => s.step_us < 10_000,
        Method::RungeKutta4ExactC => s.step_us < 13_925,
        _ => true,
    };
    let coarse = Setting::all(1000).filter(|s| s.step_us >= 1000 && is_stable(s));
    for setting in coarse.filter(|s| is_floating(s.number)) {
        let left = |output_us: usize| {
            let run = |muscle: &mut dyn Integrator| {
                run(muscle, 1000);
                for at in (400_000..=10_400_000).step_by(output_us) {
                    muscle.advance(Micros::new(at));
                }
                muscle.force_n().abs()
            };
            setting.with_integrator(&K05, run).unwrap()
        };
        for output_us in [1000, 100_000] {
            let left = left(output_us);
            assert!(left <= 1e-9, "{setting}: {left:e} N");
        }
    }
}

#[test]
fn the_shipped_method_refuses_what_the_device_refuses() {
    let spec = CalciumForceSpec { k_micro: 0, ..K05 };
    assert!(Setting::SHIPPED.with_integrator(&spec, |_| ()).is_err());
}
