//! Error against cycles of every integrator, both logarithmic: one panel per
//! interval at which the force is read.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, WIDTH, anchored, bold, legend, line, px,
    standalone, svg, text, text_width, turned,
};
use crate::accuracy::{Chart, Point, WANTED_PCT};
use firmware::bench::OUTPUTS_US;
use firmware::methods::muscle::{Method, Number, Setting};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LEGEND: i32 = 96;
const LEFT: i32 = 74;
const RIGHT: i32 = 70;
const PANEL: i32 = 540;
const GAP: i32 = 84;
/// Powers of ten: cycles per second, error in %.
const CYCLES: (i32, i32) = (4, 8);
const ERRORS: (i32, i32) = (-9, 2);

/// The two panels, as a file of its own.
pub fn picture(chart: &Chart) -> String {
    let what = "Worst error in percent of peak force against core clock cycles per simulated \
                second and muscle, for every integrator";
    let height = LEGEND + OUTPUTS_US.len() as i32 * (PANEL + GAP);
    standalone(&svg(height, what, |root| {
        draw_legends(root)?;
        for (n, output_us) in OUTPUTS_US.into_iter().enumerate() {
            let top = LEGEND + 30 + n as i32 * (PANEL + GAP);
            let points: Vec<&Point> = chart.read_every(output_us).collect();
            Panel { top, root }.draw(output_us, &points)?;
        }
        Ok(())
    }))
}

/// Methods that share a colour are drawn as one line.
fn family(method: Method) -> (&'static str, RGBColor) {
    match method {
        Method::Euler => ("Euler", PALETTE[5]),
        Method::Heun => ("Heun", PALETTE[4]),
        Method::RungeKutta4 | Method::RungeKutta4Snapped => ("RK4", PALETTE[1]),
        Method::Etd1 => ("ETD1", MUTED),
        Method::EtdMidpoint => ("ETD midpoint", PALETTE[0]),
        Method::GaussExponential => ("Gauss exponential", PALETTE[3]),
        Method::LogTable => ("log-C table", PALETTE[2]),
        Method::LogFlow => ("log-C flow", RGBColor(0x7A, 0x5A, 0xD0)),
        Method::EventDriven2 | Method::EventDriven3 | Method::EventDriven4 => {
            ("event-driven", RGBColor(0x8C, 0x56, 0x4B))
        }
        Method::Shipped => ("shipped", INK),
    }
}

fn draw_legends(root: &Area<'_>) -> Drawn {
    let mut entries: Vec<(Key, &str)> = vec![];
    for method in Method::GENERIC {
        let (name, color) = family(method);
        if entries.iter().all(|(_, other)| *other != name) {
            entries.push((Key::Box(color.filled()), name));
        }
    }
    let second = entries.split_off(entries.len() / 2);
    legend(root, LEFT - 30, 16, &entries)?;
    legend(root, LEFT - 30, 38, &second)?;
    let mut x = LEFT - 20;
    for number in Number::GENERIC {
        mark(root, (px(x), px(62)), number, INK)?;
        let words = arithmetic(number);
        root.draw(&Text::new(words, (px(x + 14), px(62)), text(13, INK)))?;
        x += 14 + text_width(13, words) + 30;
    }
    star(root, (px(x), px(62)))?;
    root.draw(&Text::new(
        "shipped",
        (px(x + 14), px(62)),
        bold(text(13, INK)),
    ))?;
    x += 14 + text_width(13, "shipped") + 30;
    let front = [(px(x - 8), px(62)), (px(x + 14), px(62))];
    root.draw(&PathElement::new(front, line(INK, 22)))?;
    root.draw(&Text::new(
        "Pareto front",
        (px(x + 22), px(62)),
        text(13, INK),
    ))?;
    let words = "A line joins the steps of one method in one arithmetic: 0.2 ms to the right, \
                 longer to the left. Explicit methods call no function: micromath hides f32.";
    root.draw(&Text::new(words, (px(LEFT - 26), px(86)), text(12, MUTED)))?;
    Ok(())
}

const fn arithmetic(number: Number) -> &'static str {
    match number {
        Number::F64 => "f64 (software)",
        Number::F32 => "f32",
        Number::Micromath => "f32, micromath",
        Number::Q15_16 => "Q15.16",
        Number::Q7_24 => "Q7.24",
        Number::Device => "device's formats",
    }
}

/// A mark for each arithmetic; filled or hollow, so that colour is not all.
fn mark(root: &Area<'_>, at: (i32, i32), number: Number, color: RGBColor) -> Drawn {
    let r = px(4);
    let square = |half: i32| [(at.0 - half, at.1 - half), (at.0 + half, at.1 + half)];
    let corner = |dx: i32, dy: i32| (at.0 + dx * r / 4, at.1 + dy * r / 4);
    let down = vec![corner(-5, -4), corner(5, -4), corner(0, 5)];
    let up = vec![corner(-5, 4), corner(5, 4), corner(0, -5)];
    match number {
        Number::F64 => root.draw(&Rectangle::new(square(r * 7 / 8), line(color, 18)))?,
        Number::F32 => root.draw(&Circle::new(at, r * 7 / 8, color.filled()))?,
        Number::Micromath => root.draw(&Circle::new(at, r * 7 / 8, line(color, 14)))?,
        Number::Q15_16 => root.draw(&Polygon::new(down, color.filled()))?,
        Number::Q7_24 => root.draw(&Polygon::new(up, color.filled()))?,
        Number::Device => star(root, at)?,
    }
    Ok(())
}

/// The shipped choice.
fn star(root: &Area<'_>, at: (i32, i32)) -> Drawn {
    let point = |n: i32| {
        let radius = f64::from(px(9)) * if n % 2 == 0 { 1.0 } else { 0.42 };
        let angle = std::f64::consts::PI * (f64::from(n) / 5.0 - 0.5);
        (
            at.0 + (radius * angle.cos()) as i32,
            at.1 + (radius * angle.sin()) as i32,
        )
    };
    root.draw(&Polygon::new(
        (0..10).map(point).collect::<Vec<_>>(),
        INK.filled(),
    ))?;
    Ok(())
}

/// One panel.
struct Panel<'a, 'b> {
    root: &'a Area<'b>,
    top: i32,
}

impl Panel<'_, '_> {
    fn draw(&self, output_us: u32, points: &[&Point]) -> Drawn {
        self.draw_axes(output_us)?;
        for (percent, name) in [
            (10.0, "10 % JND".to_owned()),
            (0.1, "0.1 %".to_owned()),
            (WANTED_PCT, format!("{WANTED_PCT} %")),
        ] {
            let y = self.y(percent);
            let path = [(px(LEFT), y), (px(WIDTH - RIGHT), y)];
            self.root.draw(&PathElement::new(path, line(MUTED, 10)))?;
            let at = (px(WIDTH - RIGHT + 6), y);
            self.root.draw(&Text::new(name, at, text(12, MUTED)))?;
        }
        self.draw_series(points)?;
        self.draw_front(points)
    }

    /// Place of so many cycles, drawing units.
    fn x(&self, cycles: f64) -> i32 {
        place(cycles, CYCLES, px(LEFT), px(WIDTH - RIGHT))
    }

    /// Place of an error, drawing units.
    fn y(&self, error_pct: f64) -> i32 {
        place(error_pct, ERRORS, px(self.top + PANEL), px(self.top))
    }

    fn at(&self, point: &Point) -> (i32, i32) {
        (self.x(point.cycles_per_s as f64), self.y(point.error_pct))
    }

    fn draw_axes(&self, output_us: u32) -> Drawn {
        let (top, bottom) = (px(self.top), px(self.top + PANEL));
        for decade in CYCLES.0..=CYCLES.1 {
            let x = self.x(10f64.powi(decade));
            let grid = [(x, top), (x, bottom)];
            self.root.draw(&PathElement::new(grid, line(GRID, 8)))?;
            let style = anchored(text(12, MUTED), HPos::Center);
            let at = (x, px(self.top + PANEL + 14));
            self.root.draw(&Text::new(power(decade), at, style))?;
        }
        for decade in ERRORS.0..=ERRORS.1 {
            let y = self.y(10f64.powi(decade));
            let grid = [(px(LEFT), y), (px(WIDTH - RIGHT), y)];
            self.root.draw(&PathElement::new(grid, line(GRID, 8)))?;
            let style = anchored(text(12, MUTED), HPos::Right);
            let words = format!("{} %", power(decade));
            self.root
                .draw(&Text::new(words, (px(LEFT - 8), y), style))?;
        }
        let often = output_us / 1000;
        let words = format!("Force read every {often} ms");
        let at = (px(LEFT), px(self.top - 14));
        self.root.draw(&Text::new(words, at, bold(text(13, INK))))?;
        let at = (px(LEFT - 64), px(self.top + PANEL / 2));
        let style = turned(text(12, INK));
        self.root
            .draw(&Text::new("worst error (% of peak)", at, style))?;
        let words =
            "Cortex-M4 cycles per simulated second and muscle (168 · 10⁶ are the whole CPU)";
        let style = anchored(text(12, INK), HPos::Center);
        let at = (px((LEFT + WIDTH - RIGHT) / 2), px(self.top + PANEL + 34));
        self.root.draw(&Text::new(words, at, style))?;
        Ok(())
    }

    /// Lines through the steps of each method and arithmetic, and all marks.
    fn draw_series(&self, points: &[&Point]) -> Drawn {
        let inside = |p: &&&Point| p.error_pct <= 10f64.powi(ERRORS.1);
        let shown: Vec<&Point> = points.iter().filter(inside).copied().collect();
        let is_same = |a: &&Point, b: &&Point| {
            let (a, b) = (a.setting, b.setting);
            a.number == b.number && a.method == b.method
        };
        let mut sorted = shown.clone();
        sorted.sort_by_key(|p| (p.setting.method, p.setting.number));
        for series in sorted.chunk_by(is_same) {
            let color = family(series[0].setting.method).1;
            let path: Vec<_> = series.iter().map(|p| self.at(p)).collect();
            self.root
                .draw(&PathElement::new(path, line(color.mix(0.45), 8)))?;
        }
        for point in shown {
            let color = family(point.setting.method).1;
            mark(self.root, self.at(point), point.setting.number, color)?;
        }
        let paper = points.iter().find(|p| p.setting == Setting::PAPER);
        paper.map_or(Ok(()), |point| self.draw_paper(self.at(point)))
    }

    /// The paper's own setting, ringed and named over what lies there.
    fn draw_paper(&self, (x, y): (i32, i32)) -> Drawn {
        let ring = Circle::new((x, y), px(8), line(INK, 16));
        self.root.draw(&ring)?;
        let words = "the paper's: RK4 f32, 0.2 ms, not split";
        let (left, width) = (x + px(14), px(text_width(12, words)));
        let corners = [(left - px(3), y - px(9)), (left + width, y + px(9))];
        self.root.draw(&Rectangle::new(corners, WHITE.filled()))?;
        self.root
            .draw(&Text::new(words, (left, y), text(12, INK)))?;
        Ok(())
    }

    /// The staircase below which nothing lies, with its points' names.
    fn draw_front(&self, points: &[&Point]) -> Drawn {
        let mut front: Vec<&&Point> = points.iter().filter(|p| p.on_front).collect();
        front.retain(|p| p.error_pct <= 10f64.powi(ERRORS.1));
        front.sort_by_key(|p| p.cycles_per_s);
        let mut path = vec![];
        let mut lowest = i32::MIN;
        for point in &front {
            let at = self.at(point);
            if let Some(&(_, y)) = path.last() {
                path.push((at.0, y));
            }
            path.push(at);
            if point.setting == Setting::SHIPPED {
                continue;
            }
            // Below the one before, where two lie close.
            let y = (at.1 + px(8)).max(lowest.saturating_add(px(14)));
            lowest = y;
            let name = name(point.setting);
            let (right, width) = (at.0 - px(7), px(text_width(12, &name)));
            let corners = [(right - width, y - px(6)), (right, y + px(6))];
            self.root.draw(&Rectangle::new(corners, WHITE.filled()))?;
            let style = anchored(text(12, INK), HPos::Right);
            self.root.draw(&Text::new(name, (right, y), style))?;
        }
        self.root.draw(&PathElement::new(path, line(INK, 22)))?;
        let shipped = points.iter().find(|p| p.setting == Setting::SHIPPED);
        if let Some(point) = shipped {
            let at = self.at(point);
            star(self.root, at)?;
            let style = bold(anchored(text(13, INK), HPos::Right));
            self.root
                .draw(&Text::new("shipped", (at.0 - px(10), at.1 - px(10)), style))?;
        }
        Ok(())
    }
}

/// A front point's label.
fn name(setting: Setting) -> String {
    let family = family(setting.method).0;
    let number = match setting.number {
        Number::Micromath if !setting.method.calls_functions() => Number::F32,
        number => number,
    };
    let number = arithmetic(number).replace(" (software)", "");
    let nodes = match setting.method {
        Method::EventDriven2 => " 2",
        Method::EventDriven3 => " 3",
        Method::EventDriven4 => " 4",
        _ => "",
    };
    if setting.step_us == Setting::WHOLE_US {
        return format!("{family}{nodes} {number}");
    }
    let step = f64::from(setting.step_us) / 1000.0;
    format!("{family}{nodes} {number}, {step} ms")
}

/// A place on a logarithmic scale between two ends, which hold what lies
/// beyond them.
fn place(value: f64, (low, high): (i32, i32), from: i32, to: i32) -> i32 {
    let part = (value.log10() - f64::from(low)) / f64::from(high - low);
    from + (f64::from(to - from) * part.clamp(0.0, 1.0)) as i32
}

/// A power of ten in figures.
fn power(decade: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match decade {
        -2 => "0.01".to_owned(),
        -1 => "0.1".to_owned(),
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        2 => "100".to_owned(),
        _ => {
            let sign = if decade < 0 { "⁻" } else { "" };
            let digit = RAISED[decade.unsigned_abs() as usize % 10];
            format!("10{sign}{digit}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_grow_with_decades_and_stay_on_the_scale() {
        assert_eq!(place(1e4, CYCLES, 100, 500), 100);
        assert_eq!(place(1e6, CYCLES, 100, 500), 300);
        assert_eq!(place(1e99, CYCLES, 100, 500), 500);
        assert_eq!(place(0.0, ERRORS, 500, 100), 500);
        assert_eq!([power(-7), power(0), power(6)], ["10⁻⁷", "1", "10⁶"]);
    }
}
