//! Draws the limb of each recorded trial at the angles in its record.

use super::Rows;
use super::figures::heading;
use crate::laboratory::result::ShownCondition;
use host_core::plot::figure::{WIDTH, draw_legend};
use host_core::plot::ink::{Color, INK, MUTED, PALETTE, channel_mark, stroke};
use host_core::plot::panel::LetterScale;
use host_core::plot::series::range;
use host_core::plot::words::truncate;
use host_core::plot::{At, Canvas, Key, Paint, Shape, Words};
use host_core::record::{Sample, Trial};
use host_core::report::{Html, draw_bones, figure};
use host_core::run::SessionFile;
use host_core::session::BodySpec;

/// Width of the text in a cell, pixels.
const WORDS: f64 = 122.0;
/// Largest scale of the drawing in a cell.
const LARGEST: f64 = 1.5;
/// Height of a line of text, pixels.
const LINE: f64 = 17.0;
/// Height of a heading above a row, pixels.
const HEADING: f64 = 24.0;
const TEXT: Words = Words::new(12.0, INK);

/// Kind of limb that is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    /// Upper arm pointing down, with a forearm that points straight down at 0° and forwards at 90°.
    Arm,
    /// Forearm and hand seen from the left, palm down. The finger is straight at 0° and bends
    /// downwards.
    Finger,
}

/// Values of a recorded trial from which its limb is drawn.
struct Limb<'a> {
    trial: &'a Trial,
    kind: Kind,
    /// Numbers of the channels, from 1, in the order of the electrodes in [`Kind::pads`].
    pads: Vec<u8>,
    /// Label and angle, °, of the two positions that are drawn; the second is the result of the
    /// trial.
    poses: [(&'static str, f64); 2],
    bound: Bound,
}

/// Angle that is drawn for comparison with the limb, °.
enum Bound {
    /// Angle of the wall, and the direction in which its inside lies: 1 towards larger angles, −1
    /// towards smaller ones.
    Wall(f64, f64),
    /// Smallest and largest angle of the reference.
    Wanted(f64, f64),
}

/// Draws the limb of each condition's trial; empty if no trial measured a joint.
pub(super) fn section<'a>(rows: &'a Rows<'a>) -> Html {
    let row = |row: &'a Vec<(&'a ShownCondition, Option<&'a Trial>)>| -> Vec<_> {
        let limbs = row.iter();
        limbs
            .map(|(shown, trial)| (*shown, trial.and_then(Limb::of)))
            .collect()
    };
    let rows: Vec<Vec<(&ShownCondition, Option<Limb<'_>>)>> = rows.iter().map(row).collect();
    let shown_limbs = || rows.iter().flatten().filter_map(|(_, limb)| limb.as_ref());
    let Some(first) = shown_limbs().next() else {
        return Html::default();
    };
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1);
    let cell = WIDTH / columns as f64;
    let scale = ((cell - WORDS) / first.kind.size().0).min(LARGEST);
    let drawn = scale * first.kind.size().0;
    let lowest = shown_limbs().map(Limb::lowest).fold(0.0, f64::max);
    let high = (scale * lowest).max(4.0 * LINE) + 12.0;
    let mut canvas = Canvas::default();
    let mut y = draw_legend(
        &mut canvas,
        LetterScale(1.0),
        (0.0, 0.0),
        &keys(first),
        WIDTH,
    );
    for row in &rows {
        let title = row
            .first()
            .map_or(String::new(), |(shown, _)| heading(shown).0);
        if !title.is_empty() {
            canvas.text((0.0, y + HEADING / 2.0), &title, TEXT.bold());
            y += HEADING;
        }
        for (n, (shown, limb)) in row.iter().enumerate() {
            let x = n as f64 * cell;
            let Some(limb) = limb else { continue };
            let own = truncate(12.0, &heading(shown).1, cell - 10.0, false);
            canvas.text(
                (x, y + LINE / 2.0),
                &own,
                Words {
                    color: MUTED,
                    ..TEXT
                },
            );
            let place = DrawingPlace {
                origin: (x, y + LINE + 6.0),
                scale,
            };
            limb.draw(&mut canvas, place);
            limb.label(&mut canvas, (x + drawn + 8.0, y + LINE + 14.0));
        }
        y += LINE + 6.0 + high;
    }
    figure(
        &canvas.svg((WIDTH, y), &description(shown_limbs())),
        &caption(first),
    )
}

/// Returns a description with every angle, for screen readers.
fn description<'a>(limbs: impl Iterator<Item = &'a Limb<'a>>) -> String {
    let texts = limbs.map(|limb| {
        let words: Vec<String> = limb.angle_labels().map(|(_, words)| words).into();
        format!("{}: {}", limb.trial.name, words.join(", "))
    });
    let texts: Vec<String> = texts.collect();
    format!(
        "Drawing of the limb in each condition. {}",
        texts.join("; ")
    )
}

fn caption(limb: &Limb<'_>) -> String {
    let is_simulated = limb
        .trial
        .identity
        .as_ref()
        .is_none_or(|identity| identity.simulated);
    let origin = match is_simulated {
        true => "Simulated: angles are those of a simulated limb's sensor.",
        false => "Angles are those of the sensor.",
    };
    format!("{origin} The limb and the electrode positions are schematic; numbers are channels.")
}

fn keys(limb: &Limb<'_>) -> Vec<(Key, String)> {
    let [(ghost, _), (main, _)] = limb.poses;
    let bound = match limb.bound {
        Bound::Wall(..) => (Key::Line(stroke(INK, 1.6)), "wall (inside shaded)"),
        Bound::Wanted(..) => (Key::Line(stroke(INK, 1.6)), "reference range"),
    };
    let pad = Paint::Full(PALETTE[1]);
    let keys = [
        (Key::Line(stroke(MUTED, 2.0)), ghost),
        (Key::Line(stroke(PALETTE[0], 2.0)), main),
        bound,
        (Key::Dot(Shape::Disc, pad), "electrode that stimulates"),
        (
            Key::Dot(Shape::Disc, Paint::Ring(MUTED, 1.5)),
            "electrode that does not",
        ),
    ];
    keys.map(|(key, name)| (key, name.to_owned())).into()
}

/// Position and scale at which a drawing is placed on its canvas.
#[derive(Clone, Copy)]
struct DrawingPlace {
    origin: At,
    scale: f64,
}

impl DrawingPlace {
    fn at(self, (x, y): At) -> At {
        (
            self.origin.0 + self.scale * x,
            self.origin.1 + self.scale * y,
        )
    }
}

impl Kind {
    /// Returns the width of the drawing and its smallest height, pixels.
    fn size(self) -> At {
        match self {
            Self::Arm => (140.0, 92.0),
            Self::Finger => (174.0, 84.0),
        }
    }

    /// Returns the position of the joint, and the length and half the thickness of the moving bone,
    /// pixels.
    fn joint(self) -> (At, f64, f64) {
        match self {
            Self::Arm => ((54.0, 80.0), 72.0, 9.0),
            Self::Finger => ((130.0, 40.0), 34.0, 6.0),
        }
    }

    /// Returns the position of the end of a bone with this length that starts at the joint, at an
    /// angle of `deg`.
    fn end(self, deg: f64, length: f64) -> At {
        let ((x, y), ..) = self.joint();
        let (sin, cos) = libm::sincos(deg.to_radians());
        match self {
            Self::Arm => (x + length * sin, y + length * cos),
            Self::Finger => (x + length * cos, y + length * sin),
        }
    }

    /// Returns the bones that do not move, each as its end points and half its thickness, pixels.
    fn fixed_bones(self) -> Vec<(Vec<At>, f64)> {
        let (joint, _, half) = self.joint();
        match self {
            Self::Arm => vec![(vec![(54.0, 12.0), joint], 11.0)],
            Self::Finger => vec![
                (vec![(16.0, 40.0), (66.0, 40.0)], 14.0),
                (vec![(80.0, 40.0), (98.0, 40.0)], 10.0),
                (vec![(98.0, 40.0), joint], half),
            ],
        }
    }

    /// Returns the positions of each electrode and of its channel label. The order is triceps and
    /// biceps, or flexor A, flexor B and extensor.
    fn pads(self) -> &'static [(At, At)] {
        match self {
            Self::Arm => &[((40.0, 40.0), (24.0, 40.0)), ((68.0, 40.0), (84.0, 40.0))],
            Self::Finger => &[
                ((26.0, 56.0), (26.0, 72.0)),
                ((54.0, 56.0), (54.0, 72.0)),
                ((40.0, 24.0), (40.0, 8.0)),
            ],
        }
    }
}

impl<'a> Limb<'a> {
    fn of(trial: &'a Trial) -> Option<Self> {
        let file = SessionFile::from_trial(trial).ok()?;
        let (kind, channels) = match file.session.body? {
            BodySpec::Finger(f) => {
                let sites = [f.flexor_a.channel, f.flexor_b.channel, f.extensor.channel];
                (Kind::Finger, sites.to_vec())
            }
            BodySpec::Elbow(e) => (Kind::Arm, vec![e.triceps.channel, e.biceps.channel]),
            BodySpec::Hand(hand) => (Kind::Finger, hand.channels.to_vec()),
            BodySpec::Arm { .. } | BodySpec::Still { .. } => return None,
        };
        let (from, to) = trial.measure.unwrap_or((0.0, f64::INFINITY));
        let judged = |s: &Sample| (from..=to).contains(&s.t_s);
        let judged = || trial.samples.iter().filter(judged);
        let (least, most) = range(judged().filter_map(|s| s.measured_deg))?;
        let (poses, bound) = match trial.wall {
            Some(wall) => {
                let start = trial.samples.iter().find_map(|s| s.measured_deg)?;
                let (side, furthest) = match wall.stops_flexion {
                    true => (1.0, most),
                    false => (-1.0, least),
                };
                let poses = [("start", start), ("furthest", furthest)];
                (poses, Bound::Wall(wall.at_deg, side))
            }
            None if trial.joint => {
                let (low, high) = range(judged().filter_map(|s| s.target_deg))?;
                ([("least", least), ("most", most)], Bound::Wanted(low, high))
            }
            None => return None,
        };
        // Sessions count channels from 0, people from 1.
        let pads = channels.into_iter();
        let pads = pads.filter_map(|channel| u8::try_from(channel + 1).ok());
        Some(Self {
            trial,
            kind,
            pads: pads.collect(),
            poses,
            bound,
        })
    }

    /// Returns whether a channel emitted a pulse in the trial.
    fn pulses(&self, channel: u8) -> bool {
        let known = self.trial.channels.iter();
        let Some(place) = known
            .clone()
            .position(|channel_info| channel_info.number == channel)
        else {
            return false;
        };
        let mut samples = self.trial.samples.iter();
        samples.any(|s| s.amplitudes.get(place).copied().flatten() > Some(0.0))
    }

    /// Returns the y coordinate of the lowest point of the drawing, pixels.
    fn lowest(&self) -> f64 {
        let (_, length, half) = self.kind.joint();
        let ends = self
            .poses
            .map(|(_, deg)| self.kind.end(deg, length).1 + half);
        ends.into_iter().fold(self.kind.size().1, f64::max)
    }

    fn draw(&self, canvas: &mut Canvas, at: DrawingPlace) {
        let (joint, length, half) = self.kind.joint();
        let path = |points: &[At]| -> Vec<At> { points.iter().map(|p| at.at(*p)).collect() };
        if let Bound::Wall(deg, side) = self.bound {
            let mut inside = vec![joint];
            inside.extend(self.arc(deg, deg + side * 30.0, length * 1.2));
            canvas.polygon(&path(&inside), Paint::Tint(MUTED));
        }
        for ((_, deg), color) in self.poses.iter().zip([MUTED, PALETTE[0]]) {
            let bone = path(&[joint, self.kind.end(*deg, length)]);
            draw_bones(canvas, &bone, half * at.scale, color);
        }
        for (joints, half) in self.kind.fixed_bones() {
            draw_bones(canvas, &path(&joints), half * at.scale, MUTED);
        }
        let bound = match self.bound {
            Bound::Wall(deg, _) => vec![joint, self.kind.end(deg, length * 1.25)],
            Bound::Wanted(low, high) => self.arc(low, high, length + half + 4.0),
        };
        canvas.line(&path(&bound), stroke(INK, 1.6));
        for (channel, (pad, number)) in self.pads.iter().zip(self.kind.pads()) {
            let (paint, color) = match self.pulses(*channel) {
                true => (channel_mark(*channel).dot(), INK),
                false => (Paint::Ring(MUTED, 1.5), MUTED),
            };
            canvas.mark(at.at(*pad), Shape::Disc, 5.0, paint);
            let words = Words { color, ..TEXT }.centred();
            canvas.text(at.at(*number), &channel.to_string(), words);
        }
    }

    /// Returns points on an arc around the joint, between two angles.
    fn arc(&self, from_deg: f64, to_deg: f64, radius: f64) -> Vec<At> {
        let step = |n: u32| from_deg + (to_deg - from_deg) * f64::from(n) / 24.0;
        (0..=24).map(|n| self.kind.end(step(n), radius)).collect()
    }

    /// Returns the labels of both positions and of the wall or reference, each in the colour of the
    /// line that it describes.
    fn angle_labels(&self) -> [(Color, String); 3] {
        let [(ghost, from), (main, to)] = self.poses;
        let bound = match self.bound {
            Bound::Wall(deg, _) => format!("wall {}°", tenths(deg)),
            Bound::Wanted(low, high) => format!("reference {} to {}°", tenths(low), tenths(high)),
        };
        [
            (MUTED, format!("{ghost} {}°", tenths(from))),
            (PALETTE[0], format!("{main} {}°", tenths(to))),
            (INK, bound),
        ]
    }

    fn label(&self, canvas: &mut Canvas, (x, y): At) {
        for (n, (color, words)) in self.angle_labels().into_iter().enumerate() {
            let words = truncate(TEXT.size, &words, WORDS - 8.0, false);
            let style = Words { color, ..TEXT };
            canvas.text((x, y + LINE * n as f64), &words, style);
        }
    }
}

/// Rounds an angle to a tenth of a degree.
fn tenths(deg: f64) -> f64 {
    (deg * 10.0).round() / 10.0 + 0.0 // turns −0 into 0
}
