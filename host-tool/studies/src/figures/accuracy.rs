//! Error against cycles of every integrator, both logarithmic: a row of panels per
//! arithmetic, a column per interval at which the force is read.

use crate::accuracy::{Chart, Point, WANTED_PCT, digits};
use host_core::plot::ink::{BROWN, INK, MUTED, PALETTE, SKY, stroke};
use host_core::plot::{At, Axis, Color, Figure, Key, Mark, Paint, Panel, Shape};
use methods::bench::OUTPUTS_US;
use methods::muscle::{Method, Number, Setting};

/// Powers of ten of the cycles per second.
const CYCLES: (i32, i32) = (4, 8);
/// The arithmetics from the top, each with its powers of ten of the error in %.
const ROWS: [(Number, &str, (i32, i32)); 5] = [
    (Number::Q7_24, "Q7.24", (-4, 2)),
    (Number::Q15_16, "Q15.16", (-3, 2)),
    (Number::F32, "f32", (-5, 2)),
    (Number::Micromath, "f32 with micromath's functions", (-4, 2)),
    (Number::F64, "f64 in software", (-9, 2)),
];
/// Pixels of a decade.
const DECADE: f64 = 34.0;

/// All panels, as a file of its own.
pub fn picture(chart: &Chart) -> String {
    let mut legend: Vec<(Key, String)> = Vec::new();
    for method in Method::GENERIC {
        let (name, color, shape) = family(method);
        if legend.iter().all(|(_, other)| other != name) {
            legend.push((Key::Marked(stroke(color, 1.4), shape), name.to_owned()));
        }
    }
    let full = Paint::Full(INK);
    legend.push((
        Key::Dot(Shape::Star, full),
        "shipped (its own formats)".to_owned(),
    ));
    legend.push((
        Key::Dot(Shape::Disc, Paint::Ring(INK, 1.6)),
        "the paper's own".to_owned(),
    ));
    legend.push((
        Key::Line(FRONT),
        "Pareto front of all arithmetics".to_owned(),
    ));
    let row = |(number, name, errors)| {
        let panels = OUTPUTS_US.map(|output_us| panel(chart, number, output_us, name, errors));
        Vec::from(panels)
    };
    let what = "Worst error in percent of peak force against core clock cycles per simulated \
                second and muscle, for every integrator";
    Figure {
        description: what.to_owned(),
        legend,
        rows: ROWS.into_iter().map(row).collect(),
        notes: vec![
            "Cycles of a Cortex-M4, 168 · 10⁶ per second are the whole CPU. A line joins the steps of \
             one method: 0.2 ms to the right, longer to the left. Methods that call no function are \
             the same with micromath's and left out there. Named: what lies on the front."
                .to_owned(),
        ],
        ..Figure::default()
    }
    .file()
}

const FRONT: host_core::plot::Stroke = stroke(INK, 1.0);

/// Methods that share a colour and a mark are of one kind.
fn family(method: Method) -> (&'static str, Color, Shape) {
    match method {
        Method::Euler => ("Euler", SKY, Shape::Disc),
        Method::Heun => ("Heun", PALETTE[4], Shape::Square),
        Method::RungeKutta4 | Method::RungeKutta4Snapped => ("RK4", PALETTE[1], Shape::Diamond),
        Method::Etd1 => ("ETD1", MUTED, Shape::Disc),
        Method::EtdMidpoint => ("ETD midpoint", PALETTE[0], Shape::Up),
        Method::GaussExponential => ("Gauss exponential", PALETTE[3], Shape::Square),
        Method::LogTable => ("log-C table", PALETTE[2], Shape::Down),
        Method::LogFlow => ("log-C flow", PALETTE[5], Shape::Diamond),
        Method::EventDriven2 | Method::EventDriven3 | Method::EventDriven4 => {
            ("event-driven", BROWN, Shape::Up)
        }
        Method::Shipped => ("shipped", INK, Shape::Star),
    }
}

/// Methods that call no function are the same with micromath's.
fn shown_in(setting: Setting) -> Number {
    match setting.number {
        Number::Micromath if !setting.method.calls_functions() => Number::F32,
        number => number,
    }
}

/// The table's own digits, so that it suffices to draw the picture.
fn at(point: &Point) -> At {
    let error = digits(point.error_pct).parse();
    (point.cycles_per_s as f64, error.unwrap_or(f64::INFINITY))
}

fn panel(chart: &Chart, number: Number, output_us: u32, name: &str, errors: (i32, i32)) -> Panel {
    let most = 10f64.powi(errors.1);
    let all: Vec<&Point> = (chart.read_every(output_us))
        .filter(|point| point.error_pct <= most)
        .collect();
    let x = Axis::decades("cycles per simulated second and muscle", CYCLES);
    let y = Axis::decades("worst error (% of peak)", errors)
        .rule(10.0, "noticed", MUTED)
        .rule(WANTED_PCT, "wanted", MUTED);
    let last = number == Number::F64;
    let title = format!("{name}; read every {} ms", output_us / 1000);
    let height = f64::from(errors.1 - errors.0) * DECADE;
    let mut marks = vec![Mark::Line(front(&all, 10f64.powi(errors.0)), FRONT)];
    let own = |p: &&&Point| p.setting.number == number && shown_in(p.setting) == number;
    let mut own: Vec<&Point> = all.iter().filter(own).copied().collect();
    own.sort_by_key(|point| point.setting.method);
    for series in own.chunk_by(|a, b| a.setting.method == b.setting.method) {
        let (_, color, shape) = family(series[0].setting.method);
        let path = series.iter().map(|point| at(point)).collect();
        marks.push(Mark::Line(path, stroke(color, 1.0)));
        let dot = |p: &&Point| Mark::Dot(at(p), shape, 3.5, Paint::Full(color));
        marks.extend(series.iter().map(dot));
    }
    for point in &all {
        if point.setting == Setting::SHIPPED {
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
    let is_named = |p: &&&Point| p.on_front && shown_in(p.setting) == number;
    let named = all.iter().filter(is_named);
    marks.extend(named.map(|p| Mark::Label(at(p), label(p.setting), INK)));
    Panel {
        marks,
        ..Panel::new(&title, x.silent(!last), y, height)
    }
}

/// The staircase below which nothing lies, down to the panel's foot.
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

/// A front point's name.
fn label(setting: Setting) -> String {
    let nodes = match setting.method {
        Method::EventDriven2 => " 2",
        Method::EventDriven3 => " 3",
        Method::EventDriven4 => " 4",
        _ => "",
    };
    let name = family(setting.method).0;
    if setting.step_us == Setting::WHOLE_US {
        return format!("{name}{nodes}");
    }
    let step = f64::from(setting.step_us) / 1000.0;
    format!("{name}{nodes}, {step} ms")
}
