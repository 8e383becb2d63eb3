//! Figure of error against cycles for every integrator, both logarithmic: one row of panels for
//! each arithmetic, one column for each interval of reading.

use crate::accuracy::{Chart, Point, WANTED_PCT, digits};
use host_core::plot::ink::{BROWN, INK, MUTED, PALETTE, SKY, stroke};
use host_core::plot::{At, Axis, Color, Figure, Key, Mark, Paint, Panel, Shape};
use methods::bench::OUTPUTS_US;
use methods::muscle::{Method, Number, Reading, Setting};

/// Exponents of the powers of ten at both ends of a logarithmic axis.
type Decades = (i32, i32);

/// Rows of panels from the top: arithmetic, its label, range of cycles per second, and range of the
/// error in %, both as powers of ten. The row of f64 leaves out the smallest errors.
const ROWS: [(Number, &str, Decades, Decades); 5] = [
    (Number::Q7_24, "Q7.24", (4, 7), (-4, 2)),
    (Number::Q15_16, "Q15.16", (4, 7), (-3, 2)),
    (Number::F32, "f32", (4, 7), (-5, 2)),
    (
        Number::Micromath,
        "f32 with micromath's functions",
        (4, 7),
        (-4, 2),
    ),
    (
        Number::F64,
        "f64 in software (down to 0.001 %)",
        (5, 8),
        (-3, 2),
    ),
];
/// Error above which people notice a difference of force, %; drawn as a line.
const NOTICED_PCT: f64 = 10.0;
/// Length of a power of ten on an axis, pixels.
const DECADE: f64 = 34.0;

/// Draws all panels as an SVG file and returns its text.
pub fn picture(chart: &Chart) -> String {
    let mut legend: Vec<(Key, String)> = Vec::new();
    for method in Method::ALL.into_iter().filter(|m| is_drawn(chart, *m)) {
        let (name, color, shape) = family(method);
        let tuned = if method.is_tuned() { " (tuned)" } else { "" };
        let name = format!("{name}{tuned}");
        if legend.iter().all(|(_, other)| *other != name) {
            legend.push((Key::Marked(stroke(color, 1.4), shape), name));
        }
    }
    let full = Paint::Full(INK);
    legend.push((
        Key::Dot(Shape::Star, full),
        "shipped (tuned, its own formats)".to_owned(),
    ));
    legend.push((
        Key::Dot(Shape::Disc, Paint::Ring(INK, 1.6)),
        "the paper's method".to_owned(),
    ));
    legend.push((
        Key::Line(FRONT),
        "Pareto front of all arithmetics".to_owned(),
    ));
    let row = |(number, name, cycles, errors)| {
        let panels =
            OUTPUTS_US.map(|output_us| panel(chart, number, output_us, name, cycles, errors));
        Vec::from(panels)
    };
    let description = "Worst error in percent of peak force against core clock cycles per simulated \
                second and muscle, for every integrator";
    Figure {
        description: description.to_owned(),
        legend,
        rows: ROWS.into_iter().map(row).collect(),
        notes: vec![
            "Simulated: cycles of a Cortex-M4 counted by the chip simulator; 168 · 10⁶ per second \
             are the whole CPU. A line joins the step sizes of one method, longer steps to the \
             left. Filled marks: steps start at each pulse, and readings are interpolated by \
             cubics. Rings: a step ends at every reading. Marks with names lie on the Pareto \
             front, with errors of at most 10 %."
                .to_owned(),
        ],
        ..Figure::default()
    }
    .file()
}

const FRONT: host_core::plot::Stroke = stroke(INK, 1.0);

fn is_drawn(chart: &Chart, method: Method) -> bool {
    let is_it = |p: &Point| p.setting.method == method && p.setting != Setting::PAPER;
    chart.points.iter().any(is_it)
}

/// Returns the label of a method, and the colour and mark of its points. Related methods share
/// colour and mark.
fn family(method: Method) -> (&'static str, Color, Shape) {
    match method {
        Method::Euler | Method::EulerExactC => ("Euler", SKY, Shape::Disc),
        Method::Heun | Method::HeunExactC => ("Heun", PALETTE[4], Shape::Square),
        Method::RungeKutta4 | Method::RungeKutta4Snapped => {
            ("RK4 on C and F", MUTED, Shape::Diamond)
        }
        Method::RungeKutta4ExactC => ("RK4", PALETTE[1], Shape::Diamond),
        Method::HermiteSimpson => ("Hermite–Simpson", PALETTE[5], Shape::Disc),
        Method::Etd1 => ("ETD1", MUTED, Shape::Disc),
        Method::EtdMidpoint => ("ETD midpoint", PALETTE[0], Shape::Up),
        Method::GaussExponential => ("Gauss exponential", PALETTE[3], Shape::Square),
        Method::RosenbrockEuler => ("Rosenbrock–Euler", MUTED, Shape::Up),
        Method::Rosenbrock3 => ("exprb32", MUTED, Shape::Square),
        Method::LogTable => ("log-C table", PALETTE[2], Shape::Down),
        Method::LogFlow => ("log-C flow", PALETTE[2], Shape::Diamond),
        Method::EventDriven2 | Method::EventDriven3 | Method::EventDriven4 => {
            ("event-driven", BROWN, Shape::Up)
        }
        Method::Segments => ("segments", INK, Shape::Square),
        Method::Shipped => ("shipped", INK, Shape::Star),
    }
}

/// Returns a point's cycles per second and its error, rounded as in the committed table, so that
/// the table suffices to draw the figure.
fn at(point: &Point) -> At {
    let error = digits(point.error_pct).parse();
    (point.cycles_per_s as f64, error.unwrap_or(f64::INFINITY))
}

fn panel(
    chart: &Chart,
    number: Number,
    output_us: u32,
    name: &str,
    cycles: (i32, i32),
    errors: (i32, i32),
) -> Panel {
    let [least, most] = [errors.0, errors.1].map(|power| 10f64.powi(power));
    let cheapest = 10f64.powi(cycles.0);
    let points: Vec<&Point> = (chart.read_every(output_us))
        .filter(|p| p.error_pct <= most && p.cycles_per_s as f64 >= cheapest)
        .collect();
    let x = Axis::decades("cycles per simulated second and muscle", cycles);
    let y = Axis::decades("worst error (% of peak)", errors)
        .reference_line(NOTICED_PCT, "noticed", MUTED)
        .reference_line(WANTED_PCT, "goal", MUTED);
    let is_last = number == Number::F64 || number == Number::Micromath;
    let title = format!("{name}; read every {} ms", output_us / 1000);
    let height = f64::from(errors.1 - errors.0) * DECADE;
    let mut marks = Vec::new();
    if number != Number::F64 {
        marks.push(Mark::Line(front(&points, least), FRONT));
    }
    let own = |p: &&&Point| p.setting.number == number && p.error_pct >= least;
    let mut own: Vec<&Point> = points.iter().filter(own).copied().collect();
    let series_of = |point: &Point| (point.setting.method, point.setting.reading);
    own.sort_by_key(|point| series_of(point));
    let is_named = |p: &&&Point| p.on_front && p.error_pct <= NOTICED_PCT;
    let named: Vec<&Point> = own.iter().filter(is_named).copied().collect();
    for series in own.chunk_by(|a, b| series_of(a) == series_of(b)) {
        let (_, color, shape) = family(series[0].setting.method);
        let path = series.iter().map(|point| at(point)).collect();
        marks.push(Mark::Line(path, stroke(color, 1.0)));
        let paint = match series[0].setting.reading {
            Reading::Steps => Paint::Ring(color, 1.3),
            Reading::Cubic => Paint::Full(color),
            Reading::Demand => Paint::Ring(color, 1.3),
        };
        let dot = |p: &&Point| Mark::Dot(at(p), shape, 3.5, paint);
        marks.extend(series.iter().map(dot));
    }
    for point in &points {
        if point.setting == Setting::SHIPPED && number != Number::F64 {
            marks.push(Mark::Dot(at(point), Shape::Star, 4.0, Paint::Full(INK)));
        } else if point.setting == Setting::PAPER && number == Number::F32 {
            marks.push(Mark::Dot(
                at(point),
                Shape::Disc,
                7.0,
                Paint::Ring(INK, 1.6),
            ));
            let words = "the paper's: 0.2 ms, not split";
            marks.push(Mark::Label(at(point), words.to_owned(), INK));
        }
    }
    for series in named.chunk_by(|a, b| series_of(a) == series_of(b)) {
        let place = at(series[series.len() / 2]);
        marks.push(Mark::Label(place, label(series), INK));
    }
    Panel {
        marks,
        ..Panel::new(&title, x.hide_labels(!is_last), y, height)
    }
}

/// Returns the Pareto front as a staircase, cut off at `foot`, the smallest error in the panel.
fn front(points: &[&Point], foot: f64) -> Vec<At> {
    let mut front: Vec<&&Point> = points.iter().filter(|p| p.on_front).collect();
    front.sort_by_key(|point| point.cycles_per_s);
    let mut path: Vec<At> = Vec::new();
    for point in front {
        let before = path.last().map(|(_, y)| (at(point).0, *y));
        path.extend(before);
        path.push((at(point).0, at(point).1.max(foot)));
        if at(point).1 < foot {
            break;
        }
    }
    path
}

/// Returns the label of one method's points on the front: the method with its range of steps.
fn label(series: &[&Point]) -> String {
    let setting = series[0].setting;
    let nodes = match setting.method {
        Method::EventDriven2 => " 2",
        Method::EventDriven3 => " 3",
        Method::EventDriven4 => " 4",
        _ => "",
    };
    let name = family(setting.method).0;
    let steps = || series.iter().map(|p| p.setting.step_us);
    let (least, most) = (steps().min().unwrap_or(0), steps().max().unwrap_or(0));
    let ms = |us: u32| f64::from(us) / 1000.0;
    match setting.step_us {
        Setting::WHOLE_US => format!("{name}{nodes}"),
        _ if least == most => format!("{name}{nodes}, {} ms", ms(least)),
        _ => format!("{name}{nodes}, {}–{} ms", ms(least), ms(most)),
    }
}
