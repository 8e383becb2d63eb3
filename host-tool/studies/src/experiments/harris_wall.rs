//! Harris et al. 2017, section 3.4: a virtual wall with and without pre-wall and
//! co-contraction, hit slowly and fast.
//!
//! The paper has one participant and says in words what its figure 8 shows: with
//! the pre-wall least penetration and oscillation; co-contraction helps, but only
//! with the pre-wall. It prints no numbers, so nothing here is compared in numbers.

use crate::stability::wall_loop::angles;
use firmware::haptics::WallSpec;
use hal_sim::body::ElbowSpec;
use hal_sim::body::elbow::Approach;
use host_core::analysis::{Hit, hits};
use host_core::record::Trial;
use host_core::run::SessionFile;
use host_core::session::SessionError;
use rayon::prelude::*;

/// The four scenarios in the paper's order: name, file, text.
#[rustfmt::skip]
const SESSIONS: [(&str, &str, &str); 4] = [
    ("pre-wall", "harris_wall/1_pre_wall.toml", include_str!("../../../sessions/harris_wall/1_pre_wall.toml")),
    ("proportional only", "harris_wall/2_proportional.toml", include_str!("../../../sessions/harris_wall/2_proportional.toml")),
    ("pre-wall, co-contraction", "harris_wall/3_pre_wall_co_contraction.toml", include_str!("../../../sessions/harris_wall/3_pre_wall_co_contraction.toml")),
    ("co-contraction", "harris_wall/4_co_contraction.toml", include_str!("../../../sessions/harris_wall/4_co_contraction.toml")),
];

/// The paper's approach speeds, °/s.
pub const SPEEDS_DEG_PER_S: [f64; 2] = [15.0, 55.0];

/// An arm's visit to the wall in the drawn comparison: s of approach and push,
/// and the last s of it in which swings are judged.
const VISIT_S: u64 = 7;
const JUDGED_S: u64 = 2;
/// A swing is less than another if it is so by this much, degrees.
const LESS_DEG: f64 = 0.1;

/// The scenarios' session files.
///
/// # Errors
/// None of the files that are part of the program has any.
pub fn sessions() -> Result<Vec<(&'static str, SessionFile)>, SessionError> {
    let parse = |&(name, file, text): &(&'static str, &str, &str)| {
        Ok((name, SessionFile::parse(file, text)?))
    };
    SESSIONS.iter().map(parse).collect()
}

/// The hit of a trial whose speed is nearest to `speed_deg_per_s`.
pub fn hit_at(trial: &Trial, speed_deg_per_s: f64) -> Option<Hit> {
    let far = |hit: &Hit| (hit.speed_deg_per_s - speed_deg_per_s).abs();
    hits(trial)
        .into_iter()
        .min_by(|a, b| far(a).total_cmp(&far(b)))
}

/// What one arm did at one speed in one scenario.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Visit {
    /// Deepest penetration of the wall, degrees, negative in front of it.
    pub deepest_deg: f64,
    /// The same from where the first current flows: the pre-wall's begin.
    pub beyond_begin_deg: f64,
    /// Peak to peak over the last two seconds of pushing, degrees.
    pub swing_deg: f64,
}

/// One drawn arm at one speed, in the order of [`sessions`].
pub type Visits = [Visit; 4];

/// Shares of visits (0 to 1) in which something was so.
#[derive(Clone, Copy, PartialEq, Debug, Default, serde::Serialize)]
pub struct Shares {
    /// Visits per scenario: arms times speeds.
    pub visits: usize,
    /// The pre-wall let the arm less deep into the wall.
    pub pre_wall_less_deep: f64,
    /// It let it less far beyond where current begins to flow.
    pub pre_wall_less_beyond_begin: f64,
    /// It let it swing no more.
    pub pre_wall_swings_no_more: f64,
    /// Co-contraction let it swing less, with the pre-wall.
    pub co_contraction_helps_with_pre_wall: f64,
    /// Co-contraction let it swing less, without.
    pub co_contraction_helps_without: f64,
    /// Co-contraction let it swing less with the pre-wall and not without: what
    /// the paper concludes.
    pub helps_only_with_pre_wall: f64,
}

/// Sends `arms` arms drawn from `seed` at each speed into each scenario's wall,
/// without a board around it; `go_on` hears the part done, 0 to 1, and may say no:
/// then the visits until then are all.
///
/// # Errors
/// As [`sessions`].
pub fn drawn(
    arms: u64,
    seed: u64,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Vec<Visits>, SessionError> {
    let walls: Vec<WallSpec> = sessions()?
        .iter()
        .filter_map(|(_, file)| file.session.wall)
        .map(measured_by_host)
        .collect();
    let mut all = Vec::new();
    let at_once = rayon::current_num_threads();
    for first in (0..arms).step_by(at_once) {
        let last = (first + at_once as u64).min(arms);
        let some = (first..last).into_par_iter();
        let done = some.map(|index| visits(&walls, &ElbowSpec::drawn(seed, index)));
        let done: Vec<Vec<Visits>> = done.collect();
        all.extend(done.into_iter().flatten());
        if !go_on(last as f64 / arms as f64) {
            break;
        }
    }
    Ok(all)
}

/// The loop without a board measures as a host does.
fn measured_by_host(wall: WallSpec) -> WallSpec {
    WallSpec {
        sensor: firmware::control::SensorSource::Host,
        ..wall
    }
}

/// What `arm` does at either speed.
fn visits(walls: &[WallSpec], arm: &ElbowSpec) -> Vec<Visits> {
    let at_speed = |speed_deg_per_s: f64| {
        let mut arm = arm.clone();
        arm.person.approaches = vec![Approach {
            at_s: 0.0,
            speed_deg_per_s,
            for_s: VISIT_S as f64,
        }];
        std::array::from_fn(|n| visit(&walls[n], &arm))
    };
    SPEEDS_DEG_PER_S.map(at_speed).to_vec()
}

fn visit(wall: &WallSpec, arm: &ElbowSpec) -> Visit {
    let angles = angles(wall, arm.clone(), VISIT_S);
    let at_deg = f64::from(wall.at_mdeg) * 1e-3;
    let front = wall.pre_wall.map_or(0, |pre| pre.depth_mdeg);
    let span = |angles: &[f64]| {
        angles.iter().fold((f64::MAX, f64::MIN), |(low, high), &a| {
            (low.min(a), high.max(a))
        })
    };
    let deepest_deg = span(&angles).1 - at_deg;
    let (low, high) = span(&angles[angles.len() - JUDGED_S as usize * 1000..]);
    Visit {
        deepest_deg,
        beyond_begin_deg: deepest_deg + f64::from(front) * 1e-3,
        swing_deg: high - low,
    }
}

impl Shares {
    /// Of these visits.
    pub fn of(all: &[Visits]) -> Self {
        let share = |is: &dyn Fn(&Visits) -> bool| {
            all.iter().filter(|v| is(v)).count() as f64 / all.len().max(1) as f64
        };
        let less = |a: Visit, b: Visit| a.swing_deg < b.swing_deg - LESS_DEG;
        Self {
            visits: all.len(),
            pre_wall_less_deep: share(&|v| v[0].deepest_deg < v[1].deepest_deg),
            pre_wall_less_beyond_begin: share(&|v| v[0].beyond_begin_deg < v[1].beyond_begin_deg),
            pre_wall_swings_no_more: share(&|v| !less(v[1], v[0])),
            co_contraction_helps_with_pre_wall: share(&|v| less(v[2], v[0])),
            co_contraction_helps_without: share(&|v| less(v[3], v[1])),
            helps_only_with_pre_wall: share(&|v| less(v[2], v[0]) && !less(v[3], v[1])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visits_repeat_and_the_pre_wall_keeps_the_arm_further_out() {
        let some = drawn(6, 1, &mut |_| true).unwrap();
        assert_eq!(some, drawn(6, 1, &mut |_| true).unwrap());
        assert_eq!(some.len(), 12);
        assert_ne!(some, drawn(6, 2, &mut |_| true).unwrap());
        assert!(Shares::of(&some).pre_wall_less_deep > 0.9);
    }
}
