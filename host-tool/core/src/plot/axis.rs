//! Scales of axes, their ticks, and the words along them.

use super::ink::{ChannelMark, Color, INK, MUTED};
use super::series::round_step;
use super::words::{power_of_ten, width};

/// Gap that replaces each part that was cut out of an axis, pixels.
const CUT: f64 = 20.0;

/// Mapping of values on an axis to positions. A value beyond an end is drawn at that end.
#[derive(Clone, Debug, PartialEq)]
pub enum Scale {
    /// Linear scale between these two values.
    Linear(f64, f64),
    /// Logarithmic scale between these two values, which are above 0.
    Log(f64, f64),
    /// Rows or columns, as many as the number says. The middle of row or column n, from 0, is at
    /// value n.
    Rows(f64),
    /// Linear scale that shows only these parts, each from its first to its second value.
    /// Everything between the parts is cut out.
    Parts(Vec<(f64, f64)>),
}

impl Scale {
    /// Returns the position of a value, pixels. The ends of the scale are at the positions `from`
    /// and `to`.
    #[must_use]
    pub fn position(&self, value: f64, from: f64, to: f64) -> f64 {
        let along = |part: f64| from + (to - from) * part.clamp(0.0, 1.0);
        match self {
            Self::Linear(low, high) => along((value - low) / (high - low)),
            Self::Log(low, high) => {
                along(libm::log(value.max(1e-300) / low) / libm::log(high / low))
            }
            Self::Rows(count) => along((value + 0.5) / count),
            Self::Parts(parts) => {
                let cuts = CUT * (parts.len().saturating_sub(1)) as f64;
                let per_pixel = self.span() / (to - from - cuts);
                let mut left = from;
                for (low, high) in parts {
                    if value <= *high {
                        return left + (value.max(*low) - low) / per_pixel;
                    }
                    left += (high - low) / per_pixel + CUT;
                }
                left - CUT
            }
        }
    }

    /// Returns the length of the shown values, in the unit of the axis; for rows, their number.
    #[must_use]
    pub fn span(&self) -> f64 {
        match self {
            Self::Linear(low, high) | Self::Log(low, high) => high - low,
            Self::Rows(count) => *count,
            Self::Parts(parts) => parts.iter().map(|(low, high)| high - low).sum(),
        }
    }

    /// Returns the positions at which parts are cut out of a scale from `from` to `to`, pixels.
    pub(super) fn cuts(&self, from: f64, to: f64) -> Vec<f64> {
        let Self::Parts(parts) = self else {
            return Vec::new();
        };
        let starts = parts.iter().skip(1);
        starts
            .map(|(low, _)| self.position(*low, from, to) - CUT / 2.0)
            .collect()
    }
}

/// Name of a row, at the left edge of a panel.
#[derive(Clone, Debug, Default)]
pub struct Head {
    /// Vertical position of the row, as a value of the y axis.
    pub at: f64,
    /// Mark of a channel, drawn before the name; `None` for a row without a channel.
    pub mark: Option<ChannelMark>,
    /// Name of the row; it is truncated if it is too long for the panel.
    pub name: String,
    /// Second line below the name, in smaller letters; may be empty.
    pub more: String,
    /// Whether the name is bold.
    pub bold: bool,
}

/// Text at the far side of a panel: on the right for a y axis, above the plot for an x axis.
#[derive(Clone, Debug)]
pub struct FarLabel {
    /// Value on the axis that the text belongs to.
    pub at: f64,
    /// The text; it is moved along the axis if it would overlap another one.
    pub words: String,
    /// Colour of a line across the whole plot at this value; `None` for no such line.
    pub rule: Option<Color>,
    /// Colour of the short line from the plot to the text, if there is no line across the plot.
    /// With [`INK`], this short line is drawn only if the text had to be moved.
    pub color: Color,
}

/// One axis of a panel.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Name of the quantity, with its unit.
    pub name: String,
    /// Mapping of values to positions along the axis.
    pub scale: Scale,
    /// Ticks: the value and the label of each. A tick without a label has an empty text.
    pub ticks: Vec<(f64, String)>,
    /// Whether a faint grid line is drawn at every tick.
    pub grid: bool,
    /// Names of rows, at the left edge of the panel; used by a y axis only.
    pub heads: Vec<Head>,
    /// Texts at the far side: on the right for a y axis, above the plot for an x axis.
    pub far: Vec<FarLabel>,
}

impl Axis {
    /// Returns an axis with a name and a scale, and without ticks.
    #[must_use]
    pub fn new(name: &str, scale: Scale) -> Self {
        Self {
            name: name.to_owned(),
            scale,
            ticks: Vec::new(),
            grid: true,
            heads: Vec::new(),
            far: Vec::new(),
        }
    }

    /// Returns a linear axis from `low` to `high`. Its ticks divide the axis into at most `parts`
    /// steps of a round size.
    #[must_use]
    pub fn linear(name: &str, (low, high): (f64, f64), parts: f64) -> Self {
        let step = round_step(high - low, parts);
        let digits = (-libm::log10(step).floor()).max(0.0) as usize;
        let from = (low / step - 1e-9).ceil() as i64;
        let to = (high / step + 1e-9).floor() as i64;
        let tick = |n: i64| (n as f64 * step, format!("{:.digits$}", n as f64 * step));
        Self {
            ticks: (from..=to).map(tick).collect(),
            ..Self::new(name, Scale::Linear(low, high))
        }
    }

    /// Returns a logarithmic axis from 10^`low` to 10^`high`, with a tick at every power of ten.
    #[must_use]
    pub fn decades(name: &str, (low, high): (i32, i32)) -> Self {
        let tick = |n: i32| (10f64.powi(n), power_of_ten(n));
        Self {
            ticks: (low..=high).map(tick).collect(),
            ..Self::new(name, Scale::Log(10f64.powi(low), 10f64.powi(high)))
        }
    }

    /// Returns an axis of rows or columns, one for each of these names.
    #[must_use]
    pub fn rows(name: &str, names: impl IntoIterator<Item = String>) -> Self {
        let ticks: Vec<_> = (0..).map(f64::from).zip(names).collect();
        Self {
            grid: false,
            ..Self::new(name, Scale::Rows(ticks.len() as f64)).ticks(ticks)
        }
    }

    /// Returns the axis with these ticks, each a value and a label, instead of its own.
    #[must_use]
    pub fn ticks(self, ticks: Vec<(f64, String)>) -> Self {
        Self { ticks, ..self }
    }

    /// Removes the axis name, row names and tick labels if `silent`, because another panel with the
    /// same axis shows them.
    #[must_use]
    pub fn hide_labels(mut self, silent: bool) -> Self {
        if silent {
            self.name.clear();
            self.heads.clear();
            self.ticks.iter_mut().for_each(|(_, words)| words.clear());
        }
        self
    }

    /// Adds a line across the plot at the value `at`, with a text at the far side.
    #[must_use]
    pub fn reference_line(self, at: f64, words: &str, color: Color) -> Self {
        let rule = Some(color);
        self.add_far_label(at, words, rule, MUTED)
    }

    /// Adds a text at the far side at the value `at`, without a line across the plot.
    #[must_use]
    pub fn far_label(self, at: f64, words: &str) -> Self {
        self.add_far_label(at, words, None, INK)
    }

    /// Adds a text at the far side at the value `at`. `rule` is the colour of a line across the
    /// plot, and `color` that of the short line to the text; see [`FarLabel`].
    #[must_use]
    pub fn add_far_label(
        mut self,
        at: f64,
        words: &str,
        rule: Option<Color>,
        color: Color,
    ) -> Self {
        let words = words.to_owned();
        self.far.push(FarLabel {
            at,
            words,
            rule,
            color,
        });
        self
    }

    /// Returns whether the axis has a name or a tick label.
    pub(super) fn has_labels(&self) -> bool {
        !self.name.is_empty() || self.ticks.iter().any(|(_, words)| !words.is_empty())
    }

    /// Returns the width of the widest tick label, pixels, for letters of height `size`.
    pub(super) fn widest(&self, size: f64) -> f64 {
        let widths = self
            .ticks
            .iter()
            .map(|(_, words)| width(size, words, false));
        widths.fold(0.0, f64::max)
    }
}

/// Moves positions apart so that neighbours do not overlap, and keeps their order. `gaps` is the
/// space that each needs. The result is between `low` and `high` if there is enough room.
pub(super) fn spread_apart(places: &[f64], gaps: &[f64], low: f64, high: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|a, b| places[*a].total_cmp(&places[*b]));
    // Neighbours that would touch form a block around their common middle.
    let mut blocks: Vec<(Vec<usize>, f64)> = Vec::new();
    let wide = |block: &[usize]| block.iter().map(|n| gaps[*n]).sum::<f64>();
    for n in order {
        let mut block = vec![n];
        let mut middle = places[n];
        while let Some((before, at)) = blocks.pop() {
            if at + wide(&before) / 2.0 + wide(&block) / 2.0 <= middle {
                blocks.push((before, at));
                break;
            }
            block.splice(0..0, before);
            let positions = block.iter().map(|n| places[*n]);
            middle = positions.sum::<f64>() / block.len() as f64;
        }
        let half = wide(&block) / 2.0;
        let middle = middle.min(high - half).max(low + half);
        blocks.push((block, middle));
    }
    let mut out = places.to_vec();
    for (block, middle) in blocks {
        let mut from = middle - wide(&block) / 2.0;
        for n in block {
            out[n] = from + gaps[n] / 2.0;
            from += gaps[n];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_grow_with_decades_and_stay_on_the_scale() {
        let cycles = Scale::Log(1e4, 1e8);
        let at = [1e4, 1e6, 1e99, 0.0].map(|x| cycles.position(x, 100.0, 500.0).round());
        assert_eq!(at, [100.0, 300.0, 500.0, 100.0]);
        assert_eq!(Scale::Rows(4.0).position(0.0, 0.0, 80.0), 10.0);
    }

    #[test]
    fn a_cut_axis_joins_its_parts() {
        let cut = Scale::Parts(vec![(0.0, 10.0), (90.0, 100.0)]);
        let at = [0.0, 10.0, 50.0, 90.0, 100.0].map(|x| cut.position(x, 0.0, 220.0));
        assert_eq!(at, [0.0, 100.0, 120.0, 120.0, 220.0]);
        assert_eq!(cut.cuts(0.0, 220.0), [110.0]);
    }

    #[test]
    fn names_that_crowd_are_moved_apart() {
        let at = spread_apart(&[50.0, 51.0, 49.0], &[10.0; 3], 0.0, 100.0);
        assert_eq!(at, [50.0, 60.0, 40.0]);
        assert!(spread_apart(&[99.0, 99.0], &[10.0; 2], 0.0, 100.0) == [85.0, 95.0]);
    }
}
