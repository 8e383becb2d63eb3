//! Plays a pattern on a device and compares the output with the intended pattern: the same
//! terminals at the same microseconds.

use super::error::TwoPointsError;
use super::pattern::{PERIOD_US, Pattern, Points, WIDTH_US};
use super::wearers::Wearer;
use hal_sim::body::hand::Segment;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::body::{Body, CHANNELS, Drive, Lead, Load, Pulse};
use host_core::link::Port;
use host_core::run::{DeviceName, SessionFile, run};
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// Resistance of the dummy load on every channel, Ω. With this load, a device can be armed at every
/// voltage of the searches.
const LOAD_OHM: u32 = 3_000;
/// Limit of a channel, V: the largest voltage of the searches, with a margin.
const LIMIT_V: f64 = 50.0;
/// Duration of the session, µs.
const PLAYED_US: u64 = 600_000;
/// Time after the start at which the amplitudes have risen, µs.
const RISEN_US: u64 = 400_000;
/// Time from the end of a point's grounding to its next pulse, µs. It covers the two windows in
/// which the device computes the pulse.
const RENDERED_US: u32 = 500;
/// Resolution of the converter at a full scale of 60 V, V.
const STEP_V: f64 = 60.0 / 65_535.0;

/// Log of the output stages: time, µs, channel and state of the lead.
type StageEvent = Arc<Mutex<Vec<(u64, usize, Lead)>>>;

/// Simulated body that logs the states of the leads.
struct Leads {
    loads: [Load; CHANNELS],
    heard: StageEvent,
}

impl Body for Leads {
    fn pulse(&mut self, _: &Pulse) {}

    fn set_lead(&mut self, t_us: u64, channel: usize, lead: Lead) {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.push((t_us, channel, lead));
    }

    fn advance(&mut self, _: u64) -> bool {
        false
    }

    fn angle_deg(&self) -> f64 {
        0.0
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}

impl Pattern {
    /// Returns the points that need a channel, each with the start of its pulse in the period, µs.
    /// A point that is grounded but never driven gets pulses of 0 V half a period later, because
    /// every channel of a group needs a train.
    fn offsets_us(&self) -> Vec<(usize, u32)> {
        match self.points {
            Points::One(point) if self.isolated => vec![(point, 0)],
            Points::One(point) => vec![(point, 0), (1 - point, PERIOD_US / 2)],
            Points::Two { first, after_us } => vec![(first, 0), (1 - first, after_us)],
        }
    }

    /// Returns the text of a session that plays the pattern at these voltages of A and B, V.
    /// Between pulses, the session grounds points for as long as the device can.
    fn session(&self, volts: [f64; 2]) -> String {
        let mut text = format!(
            "title = \"{}\"\nduration_s = {}\n\
             [wearer]\nmax_current_ma = 20.0\nmax_charge_uc = 5.0\nrise_ms = 100\nfall_ms = 100\n",
            self.in_words(),
            PLAYED_US as f64 * 1e-6
        );
        let (mut values, mut members) = (Vec::new(), Vec::new());
        let mut offsets = self.offsets_us();
        offsets.sort_unstable();
        for &(point, offset_us) in &offsets {
            let others = offsets.iter().filter(|(other, _)| *other != point);
            let gaps = others.map(|&(_, other_us)| self.grounded_us(offset_us, other_us));
            let ground_us = gaps.min().unwrap_or(PERIOD_US - WIDTH_US - RENDERED_US);
            let is_driven = self.points != Points::One(1 - point);
            let (number, volt) = (point + 1, if is_driven { volts[point] } else { 0.0 });
            let _ = write!(
                text,
                "[[channel]]\nnumber = {number}\nname = \"{number}\"\nlimit = {LIMIT_V:.1}\n\
                 stage = {{ kind = \"voltage\", full_scale_v = 60.0, load_ohm = {LOAD_OHM} }}\n\
                 train = {{ shape = \"monophasic-cathodic\", width_us = {WIDTH_US}, \
                 ground_us = {ground_us}, period_us = {PERIOD_US}, offset_us = {offset_us} }}\n"
            );
            values.push(format!("{{ channel = {number}, value = {volt:.3} }}"));
            members.push(number.to_string());
        }
        if members.len() > 1 {
            let partner = if self.isolated {
                "isolated"
            } else {
                "conducted"
            };
            let members = members.join(", ");
            let _ = write!(
                text,
                "[[group]]\nchannels = [{members}]\npartner = \"{partner}\"\n"
            );
        }
        let values = values.join(", ");
        let _ = write!(
            text,
            "[setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\nvalues = [{values}]\n\
             [body]\nkind = \"still\"\nload_ohm = {LOAD_OHM}\n"
        );
        text
    }

    /// Returns the longest grounding after each pulse, µs, for a point that is pulsed at `own_us`
    /// while the other point is pulsed at `other_us`. An isolated point is grounded in the gaps
    /// before and after the other point's pulse, and the longer gap decides. The gap that precedes
    /// the point's own pulse is shortened by [`RENDERED_US`].
    fn grounded_us(&self, own_us: u32, other_us: u32) -> u32 {
        if !self.isolated {
            return PERIOD_US - WIDTH_US - RENDERED_US;
        }
        let after = |from: u32, to: u32| (PERIOD_US + to - from) % PERIOD_US - WIDTH_US;
        after(own_us, other_us).max(after(other_us, own_us) - RENDERED_US)
    }

    /// Plays the pattern on the simulated `device` at these voltages of A and B, V. Returns one
    /// period of the output, after the amplitudes have risen.
    ///
    /// # Errors
    /// Fails if the device cannot be opened. Returns E628 if the device is not simulated, or if the
    /// session is refused, fails or does not start.
    pub fn play_on_device(
        &self,
        volts: [f64; 2],
        device: &DeviceName,
    ) -> Result<Vec<Segment>, TwoPointsError> {
        let failed = |why: String| TwoPointsError::PutOut(self.in_words(), why);
        let text = self.session(volts);
        let file = SessionFile::parse("pattern.toml", &text).map_err(|e| failed(e.to_string()))?;
        let mut port = device.open(&file.session, 1)?;
        let heard = StageEvent::default();
        let world = port.world();
        let unsuitable = "the device is not simulated; choose --device native, chip or qemu";
        let world = world.ok_or_else(|| failed(unsuitable.to_owned()))?;
        world.body = Box::new(Leads {
            loads: [Load::Ohms(LOAD_OHM.into()); CHANNELS],
            heard: heard.clone(),
        });
        let (outcome, _) = run(&file, port, None, |_: f64| ());
        if let Some(error) = outcome.error {
            return Err(failed(error.to_string()));
        }
        let epoch_us = outcome
            .epoch_us
            .ok_or_else(|| failed("the session did not start".to_owned()))?;
        let heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(period(&heard, epoch_us + RISEN_US))
    }

    /// Describes the first difference between the output `put_out` and the intended pattern; `None`
    /// if they agree. Compares the driven voltages with `asked_v`, V, then the terminals in every
    /// microsecond. While no point is driven, a point may float where the pattern grounds it,
    /// because a device cannot ground a point up to its next pulse.
    #[must_use]
    pub fn find_difference(&self, put_out: &[Segment], asked_v: [f64; 2]) -> Option<String> {
        let volts = driven_v(put_out);
        let pulses = |point: usize| self.points != Points::One(1 - point);
        for point in [A, B].into_iter().filter(|point| pulses(*point)) {
            let short_v = asked_v[point] - volts[point];
            if !(-1e-9..=STEP_V + 5e-4).contains(&short_v) {
                let (found, asked) = (volts[point], asked_v[point]);
                return Some(format!("{found} V instead of {asked} V"));
            }
        }
        let (expected, found) = (by_microsecond(&self.period(volts)), by_microsecond(put_out));
        let is_like = |(expected, found): (&[Terminal; 3], &[Terminal; 3])| {
            let rests = !expected
                .iter()
                .any(|terminal| matches!(terminal, Terminal::Driven(_)));
            expected.iter().zip(found).all(|(expected, found)| {
                let floats = (*expected, *found) == (Terminal::Grounded, Terminal::Floating);
                expected == found || rests && floats
            })
        };
        let at_us = expected.iter().zip(&found).position(|pair| !is_like(pair));
        at_us.map(|at| {
            let (found, expected) = (&found[at], &expected[at]);
            format!("terminals {found:?} instead of {expected:?} at {at} µs")
        })
    }
}

/// Comparison of patterns on a device with the intended ones, on one wearer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputComparison {
    /// Number of different combinations of pattern and voltages that were compared.
    pub patterns: usize,
    /// Largest difference between the torque of the output and that of the intended pattern, as a
    /// fraction of the full torque of the index finger's flexors.
    pub apart: f64,
}

impl Wearer {
    /// Plays these patterns at these voltages on `device` and compares the torques of its output
    /// with those of the intended pattern at the same voltages.
    ///
    /// # Errors
    /// Returns E628 if the device plays another pattern.
    pub fn compare_outputs(
        &self,
        cases: impl IntoIterator<Item = (Pattern, [f64; 2])>,
        device: &DeviceName,
    ) -> Result<OutputComparison, TwoPointsError> {
        let mut played: Vec<(Pattern, [f64; 2])> = Vec::new();
        let (mut hand, mut apart) = (self.hand.clone(), 0.0_f64);
        for (pattern, volts) in cases {
            if played.contains(&(pattern, volts)) {
                continue;
            }
            played.push((pattern, volts));
            let put_out = pattern.play_on_device(volts, device)?;
            if let Some(why) = pattern.find_difference(&put_out, volts) {
                return Err(TwoPointsError::PutOut(pattern.in_words(), why));
            }
            let whole_nm = hand.respond(&put_out)?.index_nm();
            let alone_nm = hand
                .respond(&pattern.period(driven_v(&put_out)))?
                .index_nm();
            apart = apart.max((whole_nm - alone_nm).abs() / hand.spec().flexor_nm);
        }
        let patterns = played.len();
        Ok(OutputComparison { patterns, apart })
    }
}

impl OutputComparison {
    /// Describes the comparison of `subject` on `device` for the report page.
    #[must_use]
    pub fn in_words(&self, subject: &str, device: &DeviceName) -> String {
        let torques = match self.apart {
            0.0 => "identical to the last bit".to_owned(),
            apart => format!(
                "different by at most {:.1} % of the flexors' largest torque, because of the \
                 charge that floating leaves on the skin",
                100.0 * apart
            ),
        };
        format!(
            "All numbers of this study are computed on the simulated hand without a device. As a \
             check, {} patterns of {subject} were also played by --device {} into dummy loads. At \
             every microsecond the output equals the intended pattern, except that before its own \
             pulse a point may float while no point is driven. The torques are {torques}.",
            self.patterns,
            device.to_argument()
        )
    }
}

/// Extracts the period that begins at `begin_us` from the log.
fn period(heard: &[(u64, usize, Lead)], begin_us: u64) -> Vec<Segment> {
    let mut terminals = [Terminal::Floating; 3];
    let (mut segments, mut since_us) = (Vec::new(), begin_us);
    let end_us = begin_us + u64::from(PERIOD_US);
    let mut close = |terminals: [Terminal; 3], to_us: u64, since_us: &mut u64| {
        if to_us > *since_us {
            segments.push(Segment {
                terminals,
                lasts_us: (to_us - *since_us) as u32, // at most a period
            });
            *since_us = to_us;
        }
    };
    for &(t_us, channel, lead) in heard.iter().take_while(|(t_us, ..)| *t_us < end_us) {
        close(terminals, t_us, &mut since_us);
        if let Some(terminal) = terminals.get_mut(channel) {
            *terminal = match lead {
                Lead::Cathodic(Drive::Volts(v)) if v > 0.0 => Terminal::Driven(-v),
                Lead::Anodic(Drive::Volts(v)) if v > 0.0 => Terminal::Driven(v),
                // An output of 0 V equals ground.
                Lead::Cathodic(Drive::Volts(_)) | Lead::Anodic(Drive::Volts(_)) => {
                    Terminal::Grounded
                }
                Lead::Grounded => Terminal::Grounded,
                _ => Terminal::Floating,
            };
        }
    }
    close(terminals, end_us, &mut since_us);
    segments
}

/// Returns the amplitudes of the negative pulses at A and B in a period, V; 0 for a point that is
/// not driven.
#[must_use]
pub fn driven_v(period: &[Segment]) -> [f64; 2] {
    [A, B].map(|point| {
        let driven = period
            .iter()
            .find_map(|segment| match segment.terminals[point] {
                Terminal::Driven(v) => Some(-v),
                _ => None,
            });
        driven.unwrap_or(0.0)
    })
}

fn by_microsecond(period: &[Segment]) -> Vec<[Terminal; 3]> {
    let terminals = period
        .iter()
        .flat_map(|segment| std::iter::repeat_n(segment.terminals, segment.lasts_us as usize));
    terminals.collect()
}
