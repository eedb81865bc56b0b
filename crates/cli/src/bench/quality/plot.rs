//! Plots as SVG, legible on light and dark pages: each has a ground of its own, and both turn dark
//! where the reader prefers that.

use std::fmt::Write;

/// Pixels of the whole, and of the frame about the lines: left, top, right, bottom.
const SIZE: (f64, f64) = (640.0, 400.0);
const FRAME: [f64; 4] = [64.0, 96.0, 620.0, 344.0];
/// The lines' colours, which are told apart by eyes that do not see red or green too (Okabe and Ito 2008),
/// on light and on dark ground, and their marks, which are told apart without colours.
const LINES: [(&str, &str, Mark); 4] = [
    ("#0072b2", "#56b4e9", Mark::Circle),
    ("#d55e00", "#e69f00", Mark::Square),
    ("#767676", "#a8a8a8", Mark::Diamond),
    ("#009e73", "#2bcf9f", Mark::Circle),
];

/// Some series over one axis, which doubles from mark to mark.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub(super) title: String,
    /// What the axes show, with units.
    pub(super) x: String,
    pub(super) y: String,
    /// Whether the axis of y begins at zero.
    pub(super) from_zero: bool,
    pub(super) series: Vec<Series>,
}

/// One line of a plot.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) name: String,
    /// Pairs of x, which is more than 0, and y.
    pub(super) points: Vec<(f64, f64)>,
}

#[derive(Clone, Copy, Debug)]
enum Mark {
    Circle,
    Square,
    Diamond,
}

impl Plot {
    /// The plot as an SVG file.
    pub(super) fn svg(&self) -> String {
        let axes = Axes::new(self);
        let mut svg = head();
        text(&mut svg, (FRAME[0], 26.0), "title", &self.title);
        axes.draw(&mut svg, self);
        for (n, series) in self.series.iter().enumerate() {
            axes.line(&mut svg, n % LINES.len(), series);
            self.legend(&mut svg, n);
        }
        svg + "</svg>\n"
    }

    fn legend(&self, svg: &mut String, n: usize) {
        let (x, y) = (FRAME[0] + 8.0, 44.0 + 16.0 * n as f64);
        mark(svg, n % LINES.len(), (x, y - 4.0));
        text(svg, (x + 12.0, y), "", &self.series[n].name);
    }
}

/// How values become places.
struct Axes {
    /// Logarithms of x at the frame's sides.
    x: (f64, f64),
    y: (f64, f64),
    /// Where y is marked: from the least on, by steps of so much.
    step: f64,
    /// Where x is marked.
    marks: Vec<f64>,
}

impl Axes {
    fn new(plot: &Plot) -> Self {
        let points = || plot.series.iter().flat_map(|series| &series.points);
        let mut marks: Vec<f64> = points().map(|(x, _)| *x).collect();
        marks.sort_by(f64::total_cmp);
        marks.dedup();
        let [first, last] = [marks.first(), marks.last()].map(|x| x.map_or(0.0, |x| x.log2()));
        let finite = || points().map(|(_, y)| *y).filter(|y| y.is_finite());
        let most = finite().fold(f64::NEG_INFINITY, f64::max);
        let least = finite().fold(if plot.from_zero { 0.0 } else { f64::INFINITY }, f64::min);
        let (least, most) = if least <= most { (least, most) } else { (0.0, 1.0) };
        let step = nice((most - least).max(1e-3 * most.abs()).max(1e-9) / 5.0);
        let y = ((least / step).floor() * step, (most / step).ceil() * step);
        // One point alone stands in the middle; equal values get a step to stand on.
        let x = if first < last { (first, last) } else { (first - 1.0, last + 1.0) };
        let y = if y.0 < y.1 { y } else { (y.0, y.0 + step) };
        Self { x, y, step, marks }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [left, top, right, bottom] = FRAME;
        let across = (x.log2() - self.x.0) / (self.x.1 - self.x.0);
        let up = (y - self.y.0) / (self.y.1 - self.y.0);
        // Marks keep off the frame's sides.
        (left + 24.0 + across * (right - left - 48.0), bottom - up * (bottom - top))
    }

    fn draw(&self, svg: &mut String, plot: &Plot) {
        let [left, top, right, bottom] = FRAME;
        let digits = (-self.step.log10().floor()).max(0.0) as usize;
        let steps = ((self.y.1 - self.y.0) / self.step).round() as usize;
        for n in 0..=steps {
            let value = self.y.0 + n as f64 * self.step;
            let (_, y) = self.place((1.0, value));
            push(svg, format_args!("<path class=\"grid\" d=\"M{left} {y:.1}H{right}\"/>\n"));
            text(svg, (left - 8.0, y + 4.0), "end", &format!("{value:.digits$}"));
        }
        for mark in &self.marks {
            let (x, _) = self.place((*mark, 0.0));
            push(svg, format_args!("<path class=\"axis\" d=\"M{x:.1} {bottom}v5\"/>\n"));
            text(svg, (x, bottom + 20.0), "middle", &mark.to_string());
        }
        push(svg, format_args!("<path class=\"axis\" d=\"M{left} {bottom}H{right}\"/>\n"));
        text(svg, (0.5 * (left + right), bottom + 42.0), "middle", &plot.x);
        text(svg, (12.0, top - 14.0), "", &plot.y);
    }

    fn line(&self, svg: &mut String, style: usize, series: &Series) {
        let points = series.points.iter().filter(|(_, y)| y.is_finite());
        let places: Vec<_> = points.map(|point| self.place(*point)).collect();
        let path: Vec<_> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        push(svg, format_args!("<polyline class=\"l{style}\" points=\"{}\"/>\n", path.join(" ")));
        places.into_iter().for_each(|place| mark(svg, style, place));
    }
}

/// The next of 1, 2, 5, 10, … times a power of ten.
fn nice(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|n| n * power).find(|n| *n >= step).unwrap_or(10.0 * power)
}

fn mark(svg: &mut String, style: usize, (x, y): (f64, f64)) {
    let shape = match LINES[style].2 {
        Mark::Circle => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\""),
        Mark::Square => {
            let (x, y) = (x - 3.5, y - 3.5);
            format!("<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"7\" height=\"7\"")
        }
        Mark::Diamond => format!("<path d=\"M{x:.1} {:.1}l5 5l-5 5l-5 -5z\"", y - 5.0),
    };
    push(svg, format_args!("{shape} class=\"m{style}\"/>\n"));
}

fn text(svg: &mut String, (x, y): (f64, f64), class: &str, text: &str) {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    push(svg, format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"{class}\">{text}</text>\n"));
}

fn push(svg: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing to a string does not fail.
    let _ = svg.write_fmt(what);
}

/// The file's head: the ground, and the styles of all that is drawn.
fn head() -> String {
    let (width, height) = SIZE;
    let colours = |dark: bool| -> String {
        let rule = |(n, (light, night, _)): (usize, &(&str, &str, Mark))| {
            let colour = if dark { night } else { light };
            format!(".l{n}{{stroke:{colour}}}.m{n}{{fill:{colour}}}")
        };
        LINES.iter().enumerate().map(rule).collect()
    };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\">\n<style>\ntext{{font:13px sans-serif;fill:#222}}.title{{font:bold 15px \
         sans-serif}}.end{{text-anchor:end}}.middle{{text-anchor:middle}}\n.ground{{fill:#fff}}\
         .grid{{stroke:#ddd}}.axis{{stroke:#555}}polyline{{fill:none;stroke-width:2}}\n{}\n\
         @media(prefers-color-scheme:dark){{text{{fill:#ddd}}.ground{{fill:#161b22}}\
         .grid{{stroke:#333}}.axis{{stroke:#999}}{}}}\n</style>\n\
         <rect class=\"ground\" width=\"{width}\" height=\"{height}\"/>\n",
        colours(false),
        colours(true),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: &[&[(f64, f64)]], from_zero: bool) -> Plot {
        let series = series
            .iter()
            .zip(["ours", "a < b & c"])
            .map(|(points, name)| Series { name: name.to_owned(), points: points.to_vec() });
        let series = series.collect();
        Plot { title: "T".into(), x: "size".into(), y: "dB".into(), from_zero, series }
    }

    /// The places that a line goes through.
    fn line(svg: &str, style: usize) -> Vec<(f64, f64)> {
        let begin = svg.split(&format!("<polyline class=\"l{style}\" points=\"")).nth(1);
        let points = begin.and_then(|s| s.split('"').next()).expect("a line");
        let point = |p: &str| {
            let (x, y) = p.split_once(',').expect("x and y");
            (x.parse().expect("a number"), y.parse().expect("a number"))
        };
        points.split_whitespace().map(point).collect()
    }

    #[test]
    fn points_stand_where_they_should() {
        let ours = [(64.0, 20.0), (128.0, 25.0), (512.0, 30.0)];
        let svg = plot(&[&ours, &[(64.0, 22.0), (512.0, f64::INFINITY)]], false).svg();
        let [left, top, right, bottom] = FRAME;
        let found = line(&svg, 0);
        // The axes go from 20 to 30 by 2, and a third of the way for one doubling of three.
        assert_eq!([found[0].1, found[1].1, found[2].1], [bottom, 0.5 * (top + bottom), top]);
        let share = (found[1].0 - found[0].0) / (found[2].0 - found[0].0);
        assert!((share - 1.0 / 3.0).abs() < 1e-3, "{share}");
        assert!(found[0].0 > left && found[2].0 < right);
        assert_eq!(line(&svg, 1).len(), 1, "what is not finite is left out");
        for text in [">ours<", ">a &lt; b &amp; c<", ">size<", ">dB<", ">512<", ">30<", ">T<"] {
            assert!(svg.contains(text), "{text} is missing: {svg}");
        }
        let zero = plot(&[&ours], true).svg();
        assert!(zero.contains(">0<") && line(&zero, 0)[0].1 < bottom);
    }

    #[test]
    fn few_points_are_drawn_too() {
        for series in [&[][..], &[&[][..]], &[&[(64.0, 5.0)]], &[&[(64.0, 5.0), (128.0, 5.0)]]] {
            for from_zero in [true, false] {
                let svg = plot(series, from_zero).svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            }
        }
        assert_eq!([0.3, 1.0, 1.2, 4.0, 7.0].map(nice), [0.5, 1.0, 2.0, 5.0, 10.0]);
    }
}
