//! `[wearer] file`: the wearer file of the person for whom a session is meant.
//!
//! The wearer file gives every value that the session leaves out. A value in the session may only
//! be stricter; a looser one is reported. Thresholds hold only under the conditions in which they
//! were found: another stage or pulse rate is refused, and another width is converted by the
//! strength–duration curve of the file, or refused without a curve.

use std::path::Path;

use firmware::control::ForceSpec;
use firmware::pulse::TrainSpec;
use firmware::safety::{StageSpec, WearerSpec};
use firmware::units::Amplitude;

use super::limits::loosest_wearer;
use crate::fields::decimal::format_scaled;
use crate::fields::document::Document;
use crate::fields::table::Table;
use crate::fields::{Problem, SessionError};
use crate::wearer::Unit;
use crate::wearer::{Electrode, Wearer, WidthError, builtin_wearer, read_limits};

/// The wearer file that a session names, with its content at the time when the session was read.
#[derive(Clone, PartialEq, Debug)]
pub struct SessionWearer {
    /// Path of the wearer file as the session gives it, relative to the session file.
    pub file: String,
    /// Text of the wearer file.
    pub text: String,
    /// Parsed content of the wearer file.
    pub wearer: Wearer,
}

/// Function that returns the text of a wearer file for the path that a session gives.
pub type WearerTexts<'a> = &'a dyn Fn(&str) -> Result<String, SessionError>;

/// Returns the text of a built-in wearer file. Only the last part of the path `file` counts, so
/// that a built-in session may name the file by any folder.
///
/// # Errors
/// E650 if no built-in wearer has this name.
pub fn builtin_wearer_text(file: &str) -> Result<String, SessionError> {
    let name = Path::new(file)
        .file_name()
        .unwrap_or_default()
        .to_string_lossy();
    let found = builtin_wearer(&name).map(str::to_owned);
    found.ok_or_else(|| unreadable_wearer(file, "no built-in wearer has this name"))
}

/// Returns the error E650: the wearer file `file` cannot be read, for `reason`.
#[must_use]
pub fn unreadable_wearer(file: &str, reason: &str) -> SessionError {
    let reason = format!("{file}: {reason}");
    SessionError::without_place(Problem::WearerUnreadable { reason })
}

/// Returns the text of the wearer file that a session in `folder` names as `file`. If the session
/// belongs to a record, this is the copy that the record keeps beside the session.
///
/// # Errors
/// E650 if the wearer file cannot be read.
pub(super) fn read_wearer_text(folder: &Path, file: &str) -> Result<String, SessionError> {
    let kept = folder.join(KEPT_AS);
    let is_record = folder.join("trial.json").is_file() && kept.is_file();
    match is_record {
        true => Wearer::text(&kept),
        false => Wearer::text(&folder.join(file)),
    }
}

/// Name of the copy of the wearer file that a record keeps in the folder of a trial.
pub const KEPT_AS: &str = "wearer.toml";

/// What a session file and its wearer file say about the wearer.
#[derive(Default)]
pub(super) struct WearerContext {
    pub(super) worn: Option<SessionWearer>,
    /// Whether the wearer file has errors, which were reported; nothing is checked against it then.
    pub(super) is_unknown: bool,
    /// Whether amplitudes must be 0, or 1 to 1.5 times the motor threshold.
    is_haptic: bool,
}

impl WearerContext {
    /// Reads the wearer from `[wearer]`. `texts` returns the text of the wearer file that
    /// `[wearer]` names.
    pub(super) fn read(doc: &Document, root: &Table<'_>, texts: WearerTexts<'_>) -> Self {
        let Some(t) = root.table("wearer") else {
            return Self::default();
        };
        let Some(file) = t.text("file") else {
            for field in ["name", "haptic_range"]
                .into_iter()
                .filter(|text| t.has(text))
            {
                t.report(field, Problem::NoWearerFile {});
            }
            let is_unknown = t.has("file");
            return Self {
                is_unknown,
                ..Self::default()
            };
        };
        let read = texts(file).and_then(|text| {
            let wearer = Wearer::parse(file, &text)?;
            let file = file.to_owned();
            Ok(SessionWearer { file, text, wearer })
        });
        let worn = match read {
            Ok(worn) => Some(worn),
            Err(e) => {
                match e.line_and_column() {
                    Some(_) => doc.report_all(e),
                    None => t.report("file", e.problem().clone()),
                }
                None
            }
        };
        if let Some(worn) = &worn {
            let study = root.table("study").filter(|study| study.has("pseudonym"));
            let name_fields = [Some((t, "name")), study.map(|study| (study, "pseudonym"))];
            for (t, field) in name_fields.into_iter().flatten() {
                if t.text(field).is_some_and(|name| name != worn.wearer.name) {
                    let name = worn.wearer.name.clone();
                    t.report(field, Problem::AnotherPerson { name });
                }
            }
        }
        Self {
            is_unknown: worn.is_none(),
            is_haptic: t.flag("haptic_range"),
            worn,
        }
    }

    /// Returns whether the wearer file has errors, which are already reported.
    pub(super) const fn is_unknown(&self) -> bool {
        self.is_unknown
    }

    /// Returns the limits of the wearer: those of the session, completed by those of the wearer
    /// file. If `[wearer]` or the wearer file has errors, returns the loosest limits, so that these
    /// errors do not lead to further ones.
    pub(super) fn limits(&self, root: &Table<'_>) -> WearerSpec {
        let file = self.worn.as_ref().map(|worn| worn.wearer.limits);
        match root.table("wearer").filter(|t| t.is_valid()) {
            None if root.has("wearer") => loosest_wearer(),
            None => WearerSpec::default(),
            Some(_) if self.is_unknown => loosest_wearer(),
            Some(t) => {
                let mut limits = read_limits(t);
                if let Some(file) = file {
                    tighten(t, &mut limits, &file);
                }
                limits
            }
        }
    }

    /// Returns the wearer's electrode under a channel, converted to the largest pulse width of the
    /// channel's train. Returns `Some(None)` without a wearer file. Returns `None` after reporting
    /// that the electrode does not match the channel's stage, rate or width.
    pub(super) fn channel_electrode(
        &self,
        t: &Table<'_>,
        (stage, train): (&StageSpec, &TrainSpec),
        notes: &mut Vec<String>,
    ) -> Option<Option<Electrode>> {
        if self.is_unknown {
            return None;
        }
        let Some(worn) = &self.worn else {
            return Some(None);
        };
        let channel = t.integer("number");
        let Some(electrode) = worn.wearer.electrode(channel) else {
            t.report("number", Problem::NoElectrode { channel });
            return None;
        };
        let is_stage = check_stage(t, electrode, stage);
        let is_rate = check_rate(t, electrode, train);
        let at = t.table("train").unwrap_or(t);
        // A limit that holds at the largest pulse width holds at all widths.
        let longest_us = train.width_us.max(train.max_width_us);
        let field = match longest_us > train.width_us {
            true => "max_width_us",
            false => "width_us",
        };
        if self.is_haptic && longest_us > train.width_us {
            let there = "one width, because of `wearer.haptic_range`".into();
            at.report(field, Problem::HoldsElsewhere { channel, there });
        }
        let fitted = match electrode.at_width(longest_us) {
            Ok(fitted) => fitted,
            Err(unfit) => {
                let there = match unfit {
                    WidthError::NoCurve => format!("{} µs", electrode.width_us),
                    WidthError::AboveLimit(threshold) => format!(
                        "{} µs; at the new width its `strength_duration` gives a threshold of {}, \
                         which is not below the wearer's limit",
                        electrode.width_us,
                        format_amplitude(electrode, threshold)
                    ),
                };
                at.report(field, Problem::HoldsElsewhere { channel, there });
                return None;
            }
        };
        if fitted.width_us != electrode.width_us {
            notes.push(conversion_note(electrode, &fitted));
        }
        (is_stage && is_rate).then_some(Some(fitted))
    }

    /// Returns the amplitude limit of a channel: that of the session, or else that of the
    /// electrode. Returns `None` after reporting that the limit is missing or too high.
    pub(super) fn channel_limit(
        &self,
        t: &Table<'_>,
        fitted: Option<&Electrode>,
    ) -> Option<Amplitude> {
        let own_limit = t.has("limit").then(|| Amplitude::new(t.integer("limit")));
        let Some(electrode) = fitted else {
            if own_limit.is_none() {
                t.report("limit", Problem::MissingField {});
            }
            return own_limit;
        };
        let haptic = electrode.haptic_range()[1];
        let most = match self.is_haptic {
            true => electrode.limit.min(haptic),
            false => electrode.limit,
        };
        match own_limit {
            Some(limit) if limit > electrode.limit => {
                let allowed = format!("at most {}", format_amplitude(electrode, electrode.limit));
                t.report("limit", Problem::Loosened { allowed });
                None
            }
            Some(limit) if limit > most => {
                self.check_haptic_range(t, "limit", electrode, limit);
                None
            }
            said => said.or(Some(most)),
        }
    }

    /// Returns the largest amplitude that a channel may reach at once, without the wearer's rise:
    /// `start` of the session, or else that of the electrode, or 0. Returns `None` after reporting
    /// that it is too high.
    pub(super) fn start_amplitude(
        &self,
        t: &Table<'_>,
        fitted: Option<&Electrode>,
        limit: Amplitude,
    ) -> Option<Amplitude> {
        let own_start = t.has("start").then(|| Amplitude::new(t.integer("start")));
        match (own_start, fitted) {
            (Some(start), Some(electrode)) if start > electrode.start => {
                let allowed = format!("at most {}", format_amplitude(electrode, electrode.start));
                t.report("start", Problem::Loosened { allowed });
                None
            }
            (Some(start), _) if start > limit => {
                let allowed = format!("0 to `limit` = {}", format_scaled(limit.get().into(), 3));
                t.report_out_of_range("start", allowed);
                None
            }
            (Some(start), _) => Some(start),
            (None, fitted) => {
                Some(fitted.map_or(Amplitude::ZERO, |electrode| electrode.start.min(limit)))
            }
        }
    }

    /// Returns the area of the electrode under a channel, mm²; reports an area larger than that in
    /// the wearer file.
    pub(super) fn area_mm2(&self, t: &Table<'_>, fitted: Option<&Electrode>) -> u32 {
        let own_area: u32 = t.integer("area_mm2");
        match fitted {
            Some(electrode) if !t.has("area_mm2") => electrode.area_mm2,
            Some(electrode) if own_area > electrode.area_mm2 => {
                let allowed = format!("at most {} mm²", electrode.area_mm2);
                t.report("area_mm2", Problem::Loosened { allowed });
                electrode.area_mm2
            }
            _ => own_area,
        }
    }

    /// Reports an amplitude that is neither 0 nor within the electrode's haptic range, if the
    /// session has `haptic_range = true`.
    pub(super) fn check_haptic_range(
        &self,
        t: &Table<'_>,
        field: &str,
        electrode: &Electrode,
        value: Amplitude,
    ) {
        let [least, most] = electrode.haptic_range();
        if self.is_haptic && value.get() != 0 && !(least..=most).contains(&value) {
            let (channel, range) = (
                electrode.channel,
                format!(
                    "{} to {}",
                    format_scaled(least.get().into(), 3),
                    format_amplitude(electrode, most)
                ),
            );
            t.report(field, Problem::OutsideHapticRange { channel, range });
        }
    }
}

/// Reports an output stage that does not match the electrode: a stage of another kind than the one
/// for which the electrode's thresholds hold, or one that assumes a larger load. Returns whether
/// the stage matches.
fn check_stage(t: &Table<'_>, electrode: &Electrode, stage: &StageSpec) -> bool {
    let channel = electrode.channel;
    let at = t.table("stage").unwrap_or(t);
    match (stage, electrode.unit) {
        (StageSpec::Current { .. }, Unit::Milliampere) => true,
        (StageSpec::Voltage { load_ohm, .. }, Unit::Volt) => {
            let fits = *load_ohm <= electrode.load_ohm;
            if !fits {
                let allowed = format!("at most {} Ω", electrode.load_ohm);
                at.report("load_ohm", Problem::Loosened { allowed });
            }
            fits
        }
        _ => {
            let there = match electrode.unit {
                Unit::Milliampere => "a current stage".to_owned(),
                Unit::Volt => "a voltage stage".to_owned(),
            };
            at.report("kind", Problem::HoldsElsewhere { channel, there });
            false
        }
    }
}

/// Reports a train whose pulse rate is outside the rates for which the electrode's thresholds hold.
/// Returns whether the rate is within them.
fn check_rate(t: &Table<'_>, electrode: &Electrode, train: &TrainSpec) -> bool {
    let at = t.table("train").unwrap_or(t);
    let field = ["period_us", "frequency_hz"][usize::from(at.has("frequency_hz"))];
    let [fastest_us, slowest_us] = periods(electrode);
    let holds = (fastest_us..=slowest_us).contains(&train.period_us);
    if !holds {
        let (channel, there) = (electrode.channel, rates(electrode));
        at.report(field, Problem::HoldsElsewhere { channel, there });
    }
    holds
}

/// Reports force control that may use a higher pulse rate than those for which the electrode's
/// thresholds hold.
pub(super) fn check_force_rate(t: &Table<'_>, electrode: &Electrode, force: &ForceSpec) {
    let [fastest_us, _] = periods(electrode);
    if force.min_period_us < fastest_us {
        let (channel, there) = (electrode.channel, rates(electrode));
        t.report(
            "max_frequency_hz",
            Problem::HoldsElsewhere { channel, there },
        );
    }
}

/// Returns the shortest and the longest period for which the electrode's thresholds hold, µs. The
/// first is rounded down and the second up.
fn periods(electrode: &Electrode) -> [u32; 2] {
    let [from, to] = electrode.holds_hz.map(|hz| 1e6 / hz);
    [to.floor() as u32, from.ceil() as u32] // saturate
}

/// Formats the pulse rates for which the electrode's thresholds hold, for example "20 to 40 Hz".
fn rates(electrode: &Electrode) -> String {
    match electrode.holds_hz {
        [from, to] if from == to => format!("{to} Hz"),
        [from, to] => format!("{from} to {to} Hz"),
    }
}

/// Formats an amplitude with its unit, for example "15 mA".
fn format_amplitude(electrode: &Electrode, value: Amplitude) -> String {
    let symbol = electrode.unit.symbol();
    format!("{} {symbol}", format_scaled(value.get().into(), 3))
}

/// Returns a note that the wearer's thresholds and limits were converted from one pulse width to
/// another, with the values before and after.
fn conversion_note(from: &Electrode, to: &Electrode) -> String {
    format!(
        "channel {}: the wearer's strength–duration curve converts the threshold from {} at {} µs \
         to {} at {} µs, and the limit from {} to {}",
        from.channel,
        format_amplitude(from, from.motor_threshold),
        from.width_us,
        format_amplitude(to, to.motor_threshold),
        to.width_us,
        format_amplitude(from, from.limit),
        format_amplitude(to, to.limit)
    )
}

/// For each named limit: if the table `t` leaves it out, copies the value of the wearer file into
/// `limits`; if `t` gives a looser value than the wearer file, reports it.
macro_rules! tightened {
    ($t:ident $limits:ident $file:ident: $($name:literal $unit:literal $places:literal $field:ident $bound:literal)*) => {
        $({
            let (said, file) = ($limits.$field, $file.$field);
            let looser = match $bound {
                "at most" => said > file,
                _ => said < file,
            };
            if !$t.has($name) {
                $limits.$field = file;
            } else if looser {
                let value = format_scaled(file.into(), $places);
                let allowed = format!("{} {value}{}", $bound, $unit);
                $t.report($name, Problem::Loosened { allowed });
            }
        })*
    };
}

fn tighten(t: &Table<'_>, limits: &mut WearerSpec, file: &WearerSpec) {
    tightened! { t limits file:
        "max_current_ma" " mA" 3 max_current_ua "at most"
        "max_charge_uc" " µC" 3 max_charge_nc "at most"
        "max_rms_ma" " mA" 3 max_rms_ua "at most"
        "rise_ms" " ms" 0 rise_ms "at least"
        "fall_ms" " ms" 0 fall_ms "at most"
        "host_timeout_ms" " ms" 0 host_timeout_ms "at most"
        "max_sum_ma" " mA" 3 max_sum_ua "at most"
        "max_sum_rms_ma" " mA" 3 max_sum_rms_ua "at most"
        "return_area_mm2" " mm²" 0 return_area_mm2 "at most"
        "rise_bursts" "" 0 rise_bursts "at least"
        "max_session_s" " s" 0 max_session_s "at most"
        "max_dose_mc" " mC" 0 max_dose_mc "at most"
        "max_step_ma" " mA" 3 max_step_ua "at most"
        "max_step_ma_per_s" " mA" 3 max_step_ua_per_s "at most"
    }
    if file.hand_stop_required && t.has("hand_stop_required") && !limits.hand_stop_required {
        let allowed = "true".into();
        t.report("hand_stop_required", Problem::Loosened { allowed });
    }
    limits.hand_stop_required |= file.hand_stop_required;
}
