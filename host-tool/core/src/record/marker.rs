//! `markers.csv`: the actions of a person at the controls while a trial ran, and the edges of the
//! trigger input and the sync output, each with device time and host time. An analysis uses them to
//! align other instruments; a rerun repeats the keys.

use super::table::Rows;
use super::{RecordError, columns};
use std::io::{self, Write};
use std::path::Path;

/// What a marker records: an action of a person at the controls, or an edge of a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MarkerKind {
    /// A person stopped all channels; the session can be resumed.
    Pause,
    /// A person resumed the session: the channels were armed and started again.
    Resume,
    /// A person raised the intensity of a channel by one step.
    Raise,
    /// A person lowered the intensity of a channel by one step.
    Lower,
    /// A person typed a text as a note.
    Mark,
    /// A person ended the session.
    Stop,
    /// An edge arrived at the trigger input.
    Trigger,
    /// The sync output, which the channel chosen in the setup drives, had a leading edge.
    Sync,
}

/// Each kind of marker with the word by which `markers.csv` names it.
pub(super) const KINDS: [(MarkerKind, &str); 8] = [
    (MarkerKind::Pause, "pause"),
    (MarkerKind::Resume, "resume"),
    (MarkerKind::Raise, "raise"),
    (MarkerKind::Lower, "lower"),
    (MarkerKind::Mark, "mark"),
    (MarkerKind::Stop, "stop"),
    (MarkerKind::Trigger, "trigger"),
    (MarkerKind::Sync, "sync"),
];

impl MarkerKind {
    /// Returns the word for this kind in `markers.csv`.
    #[must_use]
    pub fn word(self) -> &'static str {
        let found = KINDS.iter().find(|(kind, _)| *kind == self);
        found.map_or("", |(_, word)| word)
    }

    /// Returns whether the marker records an action of a person, which a rerun repeats.
    #[must_use]
    pub const fn is_by_hand(self) -> bool {
        !matches!(self, Self::Trigger | Self::Sync)
    }
}

/// One row of `markers.csv`.
#[derive(Clone, PartialEq, Debug)]
pub struct Marker {
    /// Device time since the start of the trains, s.
    pub t_s: f64,
    /// Device time since the device's boot, µs, which does not wrap.
    pub device_us: u64,
    /// Host time since the start of the trains, µs. For an action, the time at which it took
    /// effect; for an edge, the time at which the host received it.
    pub host_us: u64,
    /// Kind of event.
    pub kind: MarkerKind,
    /// Channel whose intensity was changed, from 1; `None` for all other markers.
    pub channel: Option<u8>,
    /// Intensity of the channel from this time on, percent of the amplitudes in the session file;
    /// `None` for markers that change no intensity.
    pub intensity_percent: Option<u16>,
    /// Text that was typed as a note, or the reason why an action had no effect.
    pub text: String,
}

/// Writes the header of `markers.csv`.
pub(super) fn write_header(out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", columns::header(&columns::MARKERS, &[]))
}

/// Writes one row to `out` with a single write call.
pub(super) fn write_row(out: &mut impl Write, marker: &Marker) -> io::Result<()> {
    let optional = |value: Option<u64>| value.map(|value| value.to_string()).unwrap_or_default();
    let mut row = csv::Writer::from_writer(Vec::new());
    row.write_record([
        format!("{:.6}", marker.t_s),
        marker.device_us.to_string(),
        marker.host_us.to_string(),
        marker.kind.word().to_owned(),
        optional(marker.channel.map(u64::from)),
        optional(marker.intensity_percent.map(u64::from)),
        marker.text.clone(),
    ])?;
    let row = row
        .into_inner()
        .map_err(|why| io::Error::other(why.to_string()))?;
    out.write_all(&row)
}

/// Reads `markers.csv`, but leaves out the edges of the sync output, which are numerous. An
/// incomplete last line is dropped, as in [`read_samples`](super::read_samples).
///
/// # Errors
/// The file cannot be read, or a row does not fit this table.
pub fn read_markers(path: &Path) -> Result<Vec<Marker>, RecordError> {
    let rows = Rows::open(path)?;
    if rows.is_empty() {
        return Ok(Vec::new());
    }
    let column = |name: &str| rows.column(name);
    let (t, device, host) = (column("t_s")?, column("device_us")?, column("host_us")?);
    let (kind, channel) = (column("kind")?, column("channel")?);
    let (intensity, text) = (column("intensity_percent")?, column("text")?);
    let kept: KeptMarkers = rows.map(|row| {
        Ok(Marker {
            t_s: row.get(t)?,
            device_us: row.get(device)?,
            host_us: row.get(host)?,
            kind: row.state(&KINDS, kind)?,
            channel: row.optional(channel)?,
            intensity_percent: row.optional(intensity)?,
            text: row.text(text).to_owned(),
        })
    })?;
    Ok(kept.0)
}

/// Markers of a file without the edges of the sync output, collected while the file is read.
struct KeptMarkers(Vec<Marker>);

impl FromIterator<Marker> for KeptMarkers {
    fn from_iter<I: IntoIterator<Item = Marker>>(markers: I) -> Self {
        let markers = markers.into_iter();
        Self(
            markers
                .filter(|marker| marker.kind != MarkerKind::Sync)
                .collect(),
        )
    }
}
