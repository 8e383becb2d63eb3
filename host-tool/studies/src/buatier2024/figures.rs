//! Figures 3 and 4 of the paper, redrawn from simulated wearers, and the tables that go with them.

use super::calibration::{ARMS, Curves, curves};
use super::control::LearntTorque;
use super::declaration::{Condition, HEIGHTS, Metric, Study};
use super::device::Device;
use super::error::LiftError;
use super::participant::{lift_height, lift_seed};
use super::person::{LiftWearer, nominal_values};
use super::replication::{Replication, families};
use super::tests::{PAIRS, Tested, mean_and_error};
use super::trial::{Trace, Worker};
use super::way::{RATE_HZ, waypoints};
use crate::laboratory::{Bar, Curve, Grid, Plot, Plots, Sheet, SheetAxis};
use host_core::statistics::{Spread, mean};

const MUSCLES: [&str; 4] = [
    "biceps",
    "triceps",
    "deltoid, anterior",
    "deltoid, posterior",
];
/// Time that figure 3 shows, s.
const SHOWN_S: f64 = 30.0;
/// Scale of k in plots, which show thousandths because the k of the triceps is small.
const THOUSAND: f64 = 1e3;
/// Difference of successive angles from which on the second one belongs to the trajectory of the
/// next height, degrees. Successive angles of one trajectory are nearer.
const NEXT_HEIGHT_DEG: f64 = 3.0;
/// Number of simulation steps per point of a plotted line.
const STEPS_PER_POINT: usize = 10;

/// Draws figure 3: the right hand of one wearer over the first 30 s of the second target set of
/// each condition.
pub(super) fn hands(study: &Study, person: &LiftWearer) -> Result<Sheet, LiftError> {
    let arm = &person.arms[0];
    let curves = curves(study, arm.stature_m, arm.mass_kg)?;
    let mut plots = Vec::new();
    let mut paths = Vec::new();
    for condition in Condition::ALL {
        let (held, back) = hand_paths(study, person, (&curves, condition))?;
        let over = |axis: usize| {
            let held = held
                .iter()
                .map(move |lift| Curve::line(0, lift.iter().map(|(t, place)| [*t, place[axis]])));
            let back = back
                .iter()
                .map(move |path| Curve::line(1, path.iter().map(|(t, place)| [*t, place[axis]])));
            held.chain(back).collect()
        };
        plots.push(Plot {
            title: condition.name().to_owned(),
            x: SheetAxis::linear("time (s)", [0.0, SHOWN_S]),
            y: SheetAxis::linear("height of the right hand (m)", [-0.5, 0.4]),
            curves: over(1),
            ..Plot::default()
        });
        let path = held
            .iter()
            .map(|lift| Curve::line(0, lift.iter().map(|(_, place)| *place)));
        paths.push(Plot {
            title: condition.name().to_owned(),
            x: SheetAxis::linear("forward (m)", [0.3, 0.7]),
            y: SheetAxis::linear("up (m)", [-0.5, 0.4]),
            curves: path.collect(),
            ..Plot::default()
        });
    }
    plots.extend(paths);
    let series = [
        "lift, stimulated except in none",
        "planned return to the table",
    ];
    Ok(Sheet::figure(
        "Figure 3",
        "path of the hand in the sagittal plane over 30 s",
        "Right hand of the first simulated wearer relative to the shoulder, in the second target \
         set of each condition. Upper row: height over time. Lower row: path. The paper's figure \
         shows a real participant."
            .to_owned(),
        Plots {
            beside: Condition::ALL.len(),
            series: series.map(str::to_owned).to_vec(),
            plots,
        },
    ))
}

/// Points of a hand's path: time, s, and place, m.
type TimedPath = Vec<(f64, [f64; 2])>;

/// Simulates two target sets and returns the paths of the right hand in the second: those of its
/// lifts, and those back to the table after each lift.
fn hand_paths(
    study: &Study,
    person: &LiftWearer,
    (curves, condition): (&Curves, Condition),
) -> Result<(Vec<TimedPath>, Vec<TimedPath>), LiftError> {
    let mut worker = Worker::new(study, person)?;
    let mut device = Device::new(study, curves, condition, &person.told)?;
    let day = person.aim_of_day_m(condition as u64);
    let mut learnt = [[LearntTorque::NOTHING; ARMS]; HEIGHTS];
    let (mut held, mut back, mut t) = (Vec::new(), Vec::new(), 0.0);
    let lifts = study.protocol.repetitions;
    for nth in 0..2 * lifts {
        let (height, mut trace) = (lift_height(nth), Trace::default());
        let lift = (height, lift_seed(person, nth));
        worker.lift(
            &mut device,
            lift,
            day[height],
            &mut learnt[height],
            Some(&mut trace),
        )?;
        if nth < lifts || t > SHOWN_S {
            continue;
        }
        let point = |(n, hands): (usize, &[[f64; 2]; ARMS])| (t + n as f64 / RATE_HZ, hands[1]);
        let path: TimedPath = trace
            .hands_m
            .iter()
            .enumerate()
            .step_by(STEPS_PER_POINT)
            .map(point)
            .collect();
        let Some(&(end_s, end_m)) = path.last() else {
            continue;
        };
        t = end_s + study.way.return_s;
        let [start, ..] = waypoints(study, worker.reach_m(), height);
        back.push(vec![(end_s, end_m), (t, start)]);
        held.push(path);
    }
    Ok((held, back))
}

/// Plots k over the angle, and tabulates the quartics of C, for a nominal wearer.
pub(super) fn activations(study: &Study) -> Result<[Sheet; 2], LiftError> {
    let nominal = LiftWearer::new(study, nominal_values(study), 0)?;
    let arm = &nominal.arms[0];
    let curves = curves(study, arm.stature_m, arm.mass_kg)?;
    let plots = (0..MUSCLES.len()).map(|muscle| activation_plot(&curves, muscle));
    let series = ["static optimisation, three heights", "quartic fit"];
    let caption = "Along the preregistered trajectory, with the muscles of the sources and a \
                   wearer with the middle value of every range. The paper shows its curves in a \
                   figure only and does not publish their coefficients.";
    let figure = Sheet::figure(
        "Figure 3, right",
        "activation k against joint angle",
        caption.to_owned(),
        Plots {
            beside: 2,
            series: series.map(str::to_owned).to_vec(),
            plots: plots.collect(),
        },
    );
    Ok([figure, quartic_table(&curves)])
}

/// Plots the activation of a muscle by the angle of its joint, and the quartic fitted to it.
fn activation_plot(curves: &Curves, muscle: usize) -> Plot {
    let curve = &curves.muscles[muscle];
    let joint = ["elbow flexion (°)", "shoulder flexion (°)"][muscle / 2];
    let range = curves.range_deg[muscle / 2];
    let quartic = |deg: f64| {
        let coefficients = curve.per_degree.iter().rev();
        THOUSAND * curve.peak * coefficients.fold(0.0, |sum, a| sum * deg + a)
    };
    let angles = curve.points.iter().map(|[deg, _]| *deg);
    let (low, high) = angles.fold((f64::MAX, f64::MIN), |(low, high), deg| {
        (low.min(deg), high.max(deg))
    });
    let angles = (0..=40).map(|n| low + (high - low) * f64::from(n) / 40.0);
    let marks = |points: &[[f64; 2]]| Curve {
        marked: true,
        ..Curve::line(
            0,
            points
                .iter()
                .step_by(3)
                .map(|[deg, k]| [*deg, THOUSAND * k]),
        )
    };
    let heights = curve
        .points
        .chunk_by(|a, b| (a[0] - b[0]).abs() < NEXT_HEIGHT_DEG);
    let fitted = Curve::line(1, angles.map(|deg| [deg, quartic(deg)]));
    Plot {
        title: format!("{}, {}", MUSCLES[muscle], ["lift", "drop"][muscle % 2]),
        x: SheetAxis::linear(joint, range),
        y: SheetAxis::linear(
            "k (thousandths)",
            [0.0, 1.2 * THOUSAND * curve.peak.max(0.01)],
        ),
        curves: heights.map(marks).chain([fitted]).collect(),
        ..Plot::default()
    }
}

/// Tabulates the quartics of equation 3 and their residuals.
fn quartic_table(curves: &Curves) -> Sheet {
    let heads = [
        "muscle",
        "peak k",
        "a0",
        "a1",
        "a2",
        "a3",
        "a4",
        "residual, rms",
        "residual, largest",
        "residual on device, rms",
    ];
    let rows = curves.muscles.iter().zip(MUSCLES).map(|(curve, name)| {
        let mut row = vec![name.to_owned(), format!("{:.4}", curve.peak)];
        row.extend(curve.per_degree.iter().map(|a| format!("{a:.3e}")));
        row.extend(curve.left.iter().map(|residual| format!("{residual:.3}")));
        row.push(format!("{:.3}", curve.left_on_device[0]));
        row
    });
    let caption = "C is k divided by its peak. a0 to a4 are the coefficients of the quartic in \
                   the joint angle in degrees, fitted by least squares. The device's quartic \
                   differs, because its C stays between 0 and 1.";
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    };
    Sheet::table(
        "Equation 3",
        "quartic polynomials of C",
        caption.to_owned(),
        grid,
    )
}

/// Draws figure 4: means over all wearers, with the 5th to 95th percentile of the means of the
/// simulated studies.
pub(super) fn bars(study: &Study, replications: &[Replication]) -> Sheet {
    let values = |condition: Condition, metric: Metric, height: Option<usize>| {
        let means: Vec<f64> = replications
            .iter()
            .map(|replication| {
                let values: Vec<f64> = (replication.people.iter())
                    .filter_map(|person| {
                        Some(person.condition_result(condition)?.value(metric, height))
                    })
                    .collect();
                mean_and_error(&values)[0]
            })
            .collect();
        let spread = Spread::of(&means)?;
        Some((mean(&means)?, spread.range()))
    };
    let plot = |metric: Metric, heights: Vec<Option<usize>>, ends: [f64; 2]| {
        let (mut bars, mut paper) = (Vec::new(), Vec::new());
        for (place, height) in heights.iter().enumerate() {
            for (series, condition) in Condition::ALL.into_iter().enumerate() {
                let left = place as f64 - 0.4 + 0.27 * series as f64;
                let name = height.map(|index| &study.way.heights[index].name);
                bars.extend(
                    values(condition, metric, *height).map(|(value, range)| Bar {
                        series,
                        x: [left, left + 0.24],
                        value,
                        range: Some(range),
                    }),
                );
                let printed = study.printed.iter().find(|number| {
                    (number.metric, number.condition, number.height.as_ref())
                        == (metric, condition, name)
                });
                paper.extend(printed.map(|number| [left + 0.12, number.mean]));
            }
        }
        let (name, unit) = metric.name_and_unit();
        let names = heights.iter().map(|height| {
            height.map_or_else(String::new, |index| study.way.heights[index].name.clone())
        });
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" ({unit})")
        };
        Plot {
            title: name.to_owned(),
            x: SheetAxis::categorical("", names),
            y: SheetAxis::linear(&format!("{name}{unit}"), ends),
            bars,
            paper,
            ..Plot::default()
        }
    };
    let heights: Vec<Option<usize>> = (0..HEIGHTS).map(Some).collect();
    Sheet::figure(
        "Figure 4",
        "metabolic proxy, matching error, smoothness",
        "Simulated: means of all wearers, with the 5th to 95th percentile of the studies' means. \
         Marks: the paper's values, which were measured in people. The proxy represents the heat \
         and work of muscles only; it is not equation 5, which needs gas exchange."
            .to_owned(),
        Plots {
            beside: 3,
            series: Condition::ALL
                .map(|condition| condition.name().to_owned())
                .to_vec(),
            plots: vec![
                plot(Metric::Power, vec![None], [0.0, 1.6]),
                plot(Metric::Error, heights.clone(), [0.0, 0.12]),
                plot(Metric::Smoothness, heights, [-4.5, 0.0]),
            ],
        },
    )
}

/// Tabulates in how many of the simulated studies each of the paper's tests (section IV.D) is
/// significant.
pub(super) fn tests(study: &Study, replications: &[Replication]) -> Sheet {
    let level = study.protocol.level;
    let rows = families()
        .into_iter()
        .enumerate()
        .map(|(family, (metric, height))| {
            let tests: Vec<&Tested> = (replications.iter())
                .filter_map(|replication| replication.tests.get(family))
                .collect();
            let share = |is_significant: &dyn Fn(&Tested) -> bool| {
                let count = tests.iter().filter(|test| is_significant(test)).count();
                format!("{count}/{}", tests.len())
            };
            let name = height.map_or("all", |index| &*study.way.heights[index].name);
            let mut row = vec![format!("{}, {name}", metric.name_and_unit().0)];
            row.push(share(&|test| test.normal_p.iter().any(|p| *p < level)));
            row.push(share(&|test| test.sphericity_p < level));
            row.push(share(&|test| test.anova[1] < level));
            row.extend((0..PAIRS.len()).map(|pair| share(&|test| test.pairs[pair][1] < level)));
            row
        });
    let heads = [
        "studies with p < 0.05",
        "Shapiro-Wilk",
        "Mauchly",
        "rANOVA",
        "none-resist",
        "none-assist",
        "resist-assist",
    ];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    };
    let caption = "Number of studies of eight wearers in which a test is significant: \
                   Shapiro-Wilk in any condition, Mauchly, repeated-measures analysis of variance \
                   (with the Greenhouse-Geisser correction where sphericity fails), and paired t \
                   tests with Bonferroni correction.";
    Sheet::table(
        "Section IV.D",
        "the paper's tests",
        caption.to_owned(),
        grid,
    )
}
