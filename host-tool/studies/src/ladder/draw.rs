//! Generates the random sessions on which the selection of muscle models is judged, with the ranges
//! of their values.
//!
//! Fixed before the first judged run, and not changed because of its results.

use super::DrawError;
use firmware::control::{ForceControl, ForceSpec, HoldPolicy};
use firmware::muscle::{Recruitment, RecruitmentSpec};
use firmware::units::Amplitude;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::random::Random;
use host_core::session::Session;

use crate::subjects::spec;

/// Seed of the sessions on which the selection is judged.
pub const JUDGED: u64 = 2_026;
/// Seed of the sessions that were used while the selection was developed; they are not judged.
pub const DEVELOPMENT: u64 = 7;
/// Number of sessions on which the selection is judged.
pub const SESSIONS: usize = 200;

/// Kinds of session, which follow each other in the order of their indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Constant amplitudes in trains of single pulses.
    Held,
    /// Constant amplitudes, with 2 to 10 bursts or single pulses per second.
    Bursts,
    /// Controlled forces that jump between constant values.
    Steps,
    /// Controlled forces that rise and fall in ramps.
    Ramps,
    /// A controlled force that follows a sine.
    Sine,
    /// A finger whose angle is controlled in closed loop.
    Joint,
    /// An arm that is pushed against a virtual wall.
    Wall,
    /// Controlled forces that a live client sets within declared bounds.
    LiveForce,
    /// Amplitudes that a live client sets within declared bounds.
    LiveAmplitude,
}

impl Kind {
    /// All kinds, in the order in which sessions have them.
    pub const ALL: [Self; 9] = [
        Self::Held,
        Self::Bursts,
        Self::Steps,
        Self::Ramps,
        Self::Sine,
        Self::Joint,
        Self::Wall,
        Self::LiveForce,
        Self::LiveAmplitude,
    ];

    /// Returns the name of the kind in the table docs/charts/ladder.csv.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Bursts => "bursts",
            Self::Steps => "force steps",
            Self::Ramps => "force ramps",
            Self::Sine => "force sine",
            Self::Joint => "joint",
            Self::Wall => "wall",
            Self::LiveForce => "live force",
            Self::LiveAmplitude => "live amplitude",
        }
    }
}

/// Returns session `index` of `seed`, with its kind.
///
/// # Errors
/// Fails if the parser refuses the session, which would be a defect of this module.
pub fn session(seed: u64, index: usize) -> Result<(Kind, Session), DrawError> {
    let kind = Kind::ALL[index % Kind::ALL.len()];
    let text = text(
        kind,
        &mut Random::new(seed.wrapping_mul(1_000_003) + index as u64),
    );
    let session = Session::parse("drawn.toml", &text);
    let session = session.map_err(|error| DrawError {
        index,
        why: format!("{error}"),
    })?;
    Ok((kind, session))
}

fn text(kind: Kind, random: &mut Random) -> String {
    match kind {
        Kind::Joint => joint(random),
        Kind::Wall => wall(random),
        _ => plain_session(kind, random),
    }
}

/// Returns the text of a session with one to four muscles on current stages.
fn plain_session(kind: Kind, random: &mut Random) -> String {
    let duration_s = random.log_between(2.0, 30.0);
    let count = 1 + (random.unit() * 4.0) as usize;
    let mut text = format!(
        "title = \"drawn\"\nduration_s = {duration_s:.3}\nwearer = {{ rise_ms = {} }}\n",
        whole(random.log_between(1.0, 500.0)),
    );
    let (mut values, mut forces, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
    for number in 1..=count {
        let subject = &SUBJECTS[(random.unit() * 10.0) as usize];
        let (threshold, slope) = (random.between(4.0, 12.0), random.between(0.18, 0.51));
        let hz = random.log_between(10.0, 60.0);
        let burst = match kind {
            Kind::Bursts if random.unit() < 0.5 => {
                let pulses = 2 + (random.unit() * 5.0) as u32;
                format!(", burst_count = {pulses}, burst_interval_us = 8000")
            }
            _ => String::new(),
        };
        let period_us = match kind {
            Kind::Bursts => whole(1e6 / random.log_between(2.0, 10.0)),
            _ => whole(1e6 / hz),
        };
        text.push_str(&format!(
            "[[channel]]\nnumber = {number}\nname = \"muscle {number}\"\n\
             stage = {{ kind = \"current\", full_scale_ma = 50.0 }}\nlimit = 20.0\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, \
             period_us = {period_us}, offset_us = {}{burst} }}\n",
            1_500 * (number - 1),
        ));
        let amplitude = random.between(threshold, 20.0);
        if is_forced(kind) {
            let fastest_us = (period_us / 3).max(5_000);
            text.push_str(&format!(
                "force = {{ max_frequency_hz = {} }}\n",
                1e6 / f64::from(fastest_us)
            ));
            let most_n = reach_n(subject, threshold, slope, (period_us, fastest_us));
            let top = most_n * random.between(0.3, 0.95);
            match kind {
                Kind::LiveForce => {
                    bounds.push(bound(number, top, random));
                    forces.push(course(Kind::Ramps, number, top, duration_s, random));
                }
                _ => forces.push(course(kind, number, top, duration_s, random)),
            }
        } else {
            values.push(format!("{{ channel = {number}, value = {amplitude:.3} }}"));
            if kind == Kind::LiveAmplitude {
                bounds.push(bound(number, amplitude, random));
            }
        }
        text.push_str(&muscle(subject, (threshold, slope), 20.0, random));
    }
    let kind = if values.is_empty() {
        "keep-alive"
    } else {
        "amplitudes"
    };
    text.push_str(&format!("[setpoints]\nkind = \"{kind}\"\nrate_hz = 90\n"));
    for (name, entries) in [("values", values), ("forces", forces), ("bounds", bounds)] {
        if !entries.is_empty() {
            text.push_str(&format!("{name} = [{}]\n", entries.join(", ")));
        }
    }
    text
}

const fn is_forced(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::Steps | Kind::Ramps | Kind::Sine | Kind::LiveForce
    )
}

/// Returns the line of a session that describes a muscle: its constants and recruitment, whether it
/// fatigues (one in two does), and whether the session reports its force (three in four).
fn muscle(
    p: &Parameters,
    (threshold, slope): (f64, f64),
    reference: f64,
    random: &mut Random,
) -> String {
    let spec = spec(p);
    let tires = if random.unit() < 0.5 {
        ", fatigue = {}"
    } else {
        ""
    };
    let report = random.unit() < 0.75;
    format!(
        "muscle = {{ a_n_per_s = {:.3}, k = {:.6}, tau_c_ms = {:.3}, tau1_ms = {:.3}, tau2_ms = {:.3}, \
         motor_threshold = {threshold:.3}, reference = {reference:.3}, \
         slope_per_unit = {slope:.6}, report = {report}{tires} }}\n",
        f64::from(spec.a_mn_per_s) * 1e-3,
        f64::from(spec.k_micro) * 1e-6,
        f64::from(spec.tau_c_us) * 1e-3,
        f64::from(spec.tau1_us) * 1e-3,
        f64::from(spec.tau2_us) * 1e-3,
    )
}

/// Returns the largest force that a muscle can reach under force control, N.
fn reach_n(p: &Parameters, threshold: f64, slope: f64, (period_us, fastest_us): (u32, u32)) -> f64 {
    let recruitment = Recruitment::new(RecruitmentSpec {
        motor_threshold: Amplitude::new(whole(threshold * 1e3)),
        limit: Amplitude::new(20_000),
        reference: Amplitude::new(20_000),
        slope_micro: whole(slope * 1e6),
    });
    let force = ForceSpec {
        min_period_us: fastest_us,
        hold: HoldPolicy::Hold,
        max_period_us: None,
    };
    let control = recruitment
        .and_then(|recruitment| ForceControl::new(0, &force, spec(p), recruitment, period_us));
    control.map_or(0.0, |force_control| {
        f64::from(force_control.force_range_mn().1) * 1e-3
    })
}

/// Returns the reference force of a channel as a line of a session: a sine, or points of steps or
/// ramps, up to `top`, N.
fn course(kind: Kind, number: usize, top: f64, duration_s: f64, random: &mut Random) -> String {
    if kind == Kind::Sine {
        let middle = top * random.between(0.4, 0.6);
        let swing = (top - middle).min(middle) * random.between(0.3, 1.0);
        let hz = random.log_between(0.1, 2.0);
        return format!(
            "{{ channel = {number}, offset_n = {middle:.3}, amplitude_n = {swing:.3}, frequency_hz = {hz:.3} }}"
        );
    }
    let mut points = vec!["{ at_s = 0, n = 0 }".to_owned()];
    let (mut at_s, mut is_high) = (0.0, false);
    while at_s < duration_s && points.len() < 60 {
        is_high = !is_high;
        let n = match is_high {
            true => top * random.between(0.5, 1.0),
            false => top * random.between(0.0, 0.4),
        };
        at_s += match kind {
            Kind::Steps => 0.001,
            _ => random.log_between(0.1, 3.0),
        };
        points.push(format!("{{ at_s = {at_s:.3}, n = {n:.3} }}"));
        at_s += random.log_between(0.1, 5.0);
        points.push(format!("{{ at_s = {at_s:.3}, n = {n:.3} }}"));
    }
    format!("{{ channel = {number}, points = [{}] }}", points.join(", "))
}

/// Returns the bounds within which a live client may set values of a channel, up to `top`, as a
/// line of a session.
fn bound(number: usize, top: f64, random: &mut Random) -> String {
    let least = top * random.between(0.0, 0.3);
    let steepest = match random.unit() < 0.5 {
        true => format!(", per_s = {:.3}", top / random.log_between(0.1, 1.5)),
        false => String::new(),
    };
    let shortest_s = random.log_between(0.05, 1.0);
    format!(
        "{{ channel = {number}, least = {least:.3}, most = {top:.3}{steepest}, shortest_s = {shortest_s:.3} }}"
    )
}

/// Returns the text of a session in which the default controller moves a participant's finger, with
/// muscle models for its three channels.
fn joint(random: &mut Random) -> String {
    let sites = [
        ("flexor A", 20.0, 28.0),
        ("flexor B", 25.0, 36.0),
        ("extensor", 14.0, 26.0),
    ];
    let mut text = format!(
        "title = \"drawn\"\nduration_s = {:.3}\n",
        random.log_between(6.0, 30.0)
    );
    for (place, (name, threshold, limit)) in sites.into_iter().enumerate() {
        let subject = &SUBJECTS[(random.unit() * 10.0) as usize];
        text.push_str(&format!(
            "[[channel]]\nnumber = {}\nname = \"{name}\"\n\
             stage = {{ kind = \"voltage\", full_scale_v = 60.0, load_ohm = 2000 }}\n\
             limit = {limit:.1}\ntrain = {{ shape = \"monophasic-cathodic\", width_us = 200, \
             ground_us = 1000, frequency_hz = 50.0, offset_us = {} }}\n{}",
            place + 1,
            [0, 2_000, 10_000][place],
            muscle(subject, (threshold, 0.2), limit, random),
        ));
    }
    let setpoints = match random.unit() < 0.5 {
        true => format!(
            "kind = \"angle-sine\"\noffset_deg = 45.0\namplitude_deg = {:.2}\nfrequency_hz = {:.3}\n",
            random.between(10.0, 40.0),
            random.log_between(0.1, 0.5),
        ),
        false => format!(
            "kind = \"angle-steps\"\nsteps = [{{ at_s = 0, deg = 10 }}, {{ at_s = 2, deg = {:.2} }}, {{ at_s = 4, deg = {:.2} }}]\n",
            random.between(20.0, 80.0),
            random.between(10.0, 80.0),
        ),
    };
    text + &format!(
        "[[group]]\nchannels = [1, 2]\npartner = \"conducted\"\n[joint]\nlaw = \"recommended\"\n\
         flexors = [{{ channel = 1, threshold = 20.0, max = 28.0 }}, {{ channel = 2, threshold = 25.0, max = 36.0 }}]\n\
         extensor = {{ channel = 3, threshold = 14.0, max = 26.0 }}\nhold = \"extrapolate\"\nsensor = \"adc\"\n\
         [setpoints]\nrate_hz = 90\n{setpoints}\
         [body]\nkind = \"finger\"\nparticipant = \"{}\"\nflexor_a = 1\nflexor_b = 2\nextensor = 3\n",
        ["P", "Q", "S"][(random.unit() * 3.0) as usize],
    )
}

/// Returns the text of a session in which an arm is pushed against a virtual wall twice.
fn wall(random: &mut Random) -> String {
    let mut text = "title = \"drawn\"\nduration_s = 14.0\n\
                    wearer = { max_current_ma = 80.0, rise_ms = 1 }\n"
        .to_owned();
    for (number, name, limit, width, offset) in
        [(1, "triceps", 80.0, 35, 0), (2, "biceps", 40.0, 25, 10_000)]
    {
        let subject = &SUBJECTS[(random.unit() * 10.0) as usize];
        let threshold = random.between(0.2, 0.5) * limit;
        text.push_str(&format!(
            "[[channel]]\nnumber = {number}\nname = \"{name}\"\n\
             stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\nlimit = {limit:.1}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = {width}, frequency_hz = 50.0, offset_us = {offset} }}\n{}",
            muscle(subject, (threshold, random.between(0.02, 0.1)), limit, random),
        ));
    }
    text + &format!(
        "[wall]\nat_deg = 90.0\nchannel = 1\nmax = 80.0\nstiffness_per_deg = {:.3}\n\
         pre_wall = {{ depth_deg = 9.0, begin = 20.0, end = 80.0 }}\nangle_max_deg = 150.0\nsensor = \"adc\"\n\
         [setpoints]\nkind = \"keep-alive\"\nrate_hz = 50\n\
         [body]\nkind = \"elbow\"\ntriceps = 1\nbiceps = 2\nstart_deg = 60.0\npush_nm = 1.5\napproaches = [\n\
         {{ at_s = 1.0, speed_deg_per_s = {:.2}, for_s = 5.0 }}, {{ at_s = 8.0, speed_deg_per_s = {:.2}, for_s = 5.0 }}]\n",
        random.between(4.0, 10.0),
        random.between(10.0, 60.0),
        random.between(10.0, 60.0),
    )
}

fn whole(value: f64) -> u32 {
    value.round() as u32 // the cast saturates
}
