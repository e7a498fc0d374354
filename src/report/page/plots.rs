//! Curves over time and bars of contacts, as SVG inside the page.

use std::{collections::BTreeMap, ops::Range};

use plotters::{
    backend::SVGBackend,
    chart::{ChartBuilder, ChartContext},
    coord::{Shift, cartesian::Cartesian2d, types::RangedCoordf64},
    drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea},
    element::Rectangle,
    series::LineSeries,
    style::{Color, RGBColor, ShapeStyle},
};

use super::text::{Escaped, spaced};
use crate::retarget::{ContactMeasure, Curves, Measures, MetricName};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 260;
/// Height of a row of contacts, and of the axis below them.
const ROW: u32 = 26;
const AXIS: u32 = 44;
/// More points than a screen has columns only make the page heavy.
const MAX_POINTS: usize = 960;
const LABEL: (&str, u32) = ("sans-serif", 13);

/// Told apart by people who see colors differently, and readable on white and on black.
const COLORS: [RGBColor; 10] = [
    RGBColor(0x3b, 0x82, 0xc4),
    RGBColor(0xd9, 0x7a, 0x1e),
    RGBColor(0x2a, 0x9d, 0x6f),
    RGBColor(0xc8, 0x54, 0x9b),
    RGBColor(0xa6, 0x8a, 0x1c),
    RGBColor(0x7c, 0x6c, 0xd0),
    RGBColor(0xd1, 0x4b, 0x4b),
    RGBColor(0x2f, 0x9a, 0xa8),
    RGBColor(0x8c, 0x6d, 0x58),
    RGBColor(0x80, 0x80, 0x80),
];
const PASS: RGBColor = RGBColor(0x2a, 0x9d, 0x6f);
const WARN: RGBColor = RGBColor(0xd9, 0x9a, 0x1e);
const FAIL: RGBColor = RGBColor(0xd1, 0x4b, 0x4b);
const INK: RGBColor = RGBColor(0x80, 0x80, 0x80);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// What a plot shows.
struct Plot {
    name: &'static str,
    title: &'static str,
    /// A level that is drawn across: a threshold, or the floor.
    level: Option<f64>,
}

pub(super) fn all(page: &mut String, measures: &Measures) {
    let warn_above = |metric: MetricName| measures.metrics.get(&metric).map(|metric| metric.warn_above);
    let plots = [
        Plot {
            name: "limb_direction",
            title: "Direction error of each limb",
            level: warn_above(MetricName::LimbDirection),
        },
        Plot { name: "sole_height", title: "Height of each foot's lowest point over the floor", level: Some(0.0) },
        Plot { name: "slide_speed", title: "Slide of feet while the source's stand", level: None },
    ];
    for plot in plots {
        // Where nothing applies there are curves without a single value.
        let has_values = |curves: &&Curves| curves.parts.values().flatten().any(Option::is_some);
        let Some(curves) = measures.curves.get(plot.name).filter(has_values) else { continue };
        section(page, plot.title, draw(WIDTH, HEIGHT, |area| plot.draw(area, curves)));
        legend(page, curves.parts.keys());
    }
    contacts(page, measures);
}

fn section(page: &mut String, title: &str, svg: Option<String>) {
    let Some(svg) = svg else { return };
    page.push_str(&format!("<h2>{title}</h2>\n<figure role=\"img\" aria-label=\"{title}\">{svg}</figure>\n"));
}

fn legend<'a>(page: &mut String, names: impl Iterator<Item = &'a String>) {
    page.push_str("<ul class=\"legend\">\n");
    for (name, color) in names.zip(COLORS.iter().cycle()) {
        let RGBColor(red, green, blue) = color;
        let name = spaced(name);
        page.push_str(&format!(
            "<li><span style=\"background:rgb({red},{green},{blue})\"></span>{}</li>\n",
            Escaped(&name)
        ));
    }
    page.push_str("</ul>\n");
}

/// Draws into an SVG; nothing where the plotting library refuses, which leaves the page without that plot.
fn draw(width: u32, height: u32, paint: impl FnOnce(&Area<'_>) -> Drawn) -> Option<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
        paint(&area).and_then(|()| area.present()).ok()?;
    }
    Some(svg)
}

impl Plot {
    fn draw(&self, area: &Area<'_>, curves: &Curves) -> Drawn {
        let values = curves.parts.values().flatten().flatten().copied().chain(self.level);
        let mut chart = chart(area, span(&curves.times_seconds), padded(values), &curves.unit)?;
        if let Some(level) = self.level {
            let across = span(&curves.times_seconds);
            chart.draw_series(LineSeries::new([(across.start, level), (across.end, level)], INK.stroke_width(2)))?;
        }
        for (values, color) in curves.parts.values().zip(COLORS.iter().cycle()) {
            for run in runs(&curves.times_seconds, values) {
                chart.draw_series(LineSeries::new(run, color.stroke_width(2)))?;
            }
        }
        Ok(())
    }
}

/// A curve over times of its own.
pub(in crate::report) struct Line {
    pub(in crate::report) times_seconds: Vec<f64>,
    pub(in crate::report) values: Vec<f64>,
}

/// A plot of lines as SVG.
pub(in crate::report) fn line_plot(lines: &[Line], unit: &str) -> Option<String> {
    let times = lines.iter().flat_map(|line| &line.times_seconds).copied();
    let (first, last) =
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| (low.min(time), high.max(time)));
    let up = padded(lines.iter().flat_map(|line| &line.values).copied());
    draw(WIDTH, HEIGHT, |area| {
        let mut chart = chart(area, span(&[first, last]), up.clone(), unit)?;
        for (line, color) in lines.iter().zip(COLORS.iter().cycle()) {
            let points = line.times_seconds.iter().copied().zip(line.values.iter().copied());
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        Ok(())
    })
}

fn chart<'a>(
    area: &Area<'a>,
    across: Range<f64>,
    up: Range<f64>,
    unit: &str,
) -> Result<Chart<'a>, DrawingAreaErrorKind<std::io::Error>> {
    let mut chart = ChartBuilder::on(area)
        .margin(6)
        // Half of the last label stands behind the end of the axis.
        .margin_right(24)
        .x_label_area_size(AXIS - 6)
        .y_label_area_size(60)
        .build_cartesian_2d(across, up)?;
    chart
        .configure_mesh()
        .axis_style(INK)
        .bold_line_style(INK.mix(0.25))
        .light_line_style(INK.mix(0.0))
        .label_style(LABEL)
        .axis_desc_style(LABEL)
        .x_desc("seconds")
        .y_desc(unit)
        .y_labels(6)
        .draw()?;
    Ok(chart)
}

/// Stretches without a gap, thinned to what a screen can show. A single value is a short dash.
fn runs(times: &[f64], values: &[Option<f64>]) -> Vec<Vec<(f64, f64)>> {
    let step = values.len().div_ceil(MAX_POINTS).max(1);
    let mut found: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    for (times, values) in times.chunks(step).zip(values.chunks(step)) {
        // What is farthest from zero stands for its neighbors, so that no peak is lost.
        let largest = values.iter().flatten().copied().max_by(|first, second| first.abs().total_cmp(&second.abs()));
        match (largest, found.last_mut()) {
            (Some(value), Some(run)) => run.push((times[0], value)),
            (None, Some(run)) if !run.is_empty() => found.push(Vec::new()),
            _ => {}
        }
    }
    found.retain(|run| !run.is_empty());
    let dash = (times.last().copied().unwrap_or(0.0) - times.first().copied().unwrap_or(0.0)) / MAX_POINTS as f64 * 3.0;
    for run in found.iter_mut().filter(|run| run.len() == 1) {
        let (time, value) = run[0];
        run.push((time + dash, value));
    }
    found
}

fn contacts(page: &mut String, measures: &Measures) {
    let mut rows: BTreeMap<String, Vec<&ContactMeasure>> = BTreeMap::new();
    for contact in &measures.contacts {
        rows.entry(format!("{} {}", contact.part, contact.point)).or_default().push(contact);
    }
    let Some(slide) = measures.metrics.get(&MetricName::FootSlide).filter(|_| !rows.is_empty()) else { return };
    let color = |contact: &ContactMeasure| {
        if contact.slide_cm <= slide.warn_above.max(contact.source_slide_cm) {
            PASS
        } else if contact.slide_cm
            <= slide.fail_above.max(contact.source_slide_cm + slide.fail_above - slide.warn_above)
        {
            WARN
        } else {
            FAIL
        }
    };
    let times = measures.curves.get("sole_height").map(|curves| curves.times_seconds.as_slice()).unwrap_or_default();
    let ends = measures.contacts.iter().map(|contact| contact.end_seconds);
    let last = ends.chain(times.last().copied()).fold(0.0, f64::max);
    let first = times.first().copied().unwrap_or(0.0).min(0.0);
    let height = u32::try_from(rows.len()).unwrap_or(u32::MAX).saturating_mul(ROW).saturating_add(AXIS + 16);
    let svg = draw(WIDTH, height, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(6)
            .margin_right(24)
            .x_label_area_size(AXIS - 6)
            .y_label_area_size(60)
            .build_cartesian_2d(span(&[first, last]), 0.0..rows.len() as f64)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .disable_y_axis()
            .axis_style(INK)
            .bold_line_style(INK.mix(0.25))
            .light_line_style(INK.mix(0.0))
            .label_style(LABEL)
            .axis_desc_style(LABEL)
            .x_desc("seconds")
            .draw()?;
        for (row, contacts) in rows.values().enumerate() {
            let (bottom, top) = ((rows.len() - row) as f64 - 0.85, (rows.len() - row) as f64 - 0.15);
            chart.draw_series(contacts.iter().map(|contact| {
                let corners = [(contact.start_seconds, bottom), (contact.end_seconds.max(contact.start_seconds), top)];
                Rectangle::new(corners, ShapeStyle::from(color(contact)).filled())
            }))?;
        }
        Ok(())
    });
    let Some(svg) = svg else { return };
    let title = "Contacts of the source's feet, by how far the target's slide in them";
    page.push_str(&format!("<h2>{title}</h2>\n<figure role=\"img\" aria-label=\"{title}\">{svg}</figure>\n"));
    let names: Vec<String> = rows.keys().map(|name| Escaped(&spaced(name)).to_string()).collect();
    page.push_str(&format!("<p><small>Rows from the top: {}. ", names.join(", ")));
    page.push_str("Green passes, amber warns, red fails.</small></p>\n");
}

/// A range that has a width.
fn span(values: &[f64]) -> Range<f64> {
    let (first, last) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
    if last > first { first..last } else { first..first + 1.0 }
}

/// The range of values, with a little room.
fn padded(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let room = ((high - low) * 0.08).max(1e-3);
    (if low < 0.0 { low - room } else { 0.0 })..high + room
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_end_a_line_and_peaks_stay() {
        let times: Vec<f64> = (0..6).map(f64::from).collect();
        let values = [Some(1.0), Some(2.0), None, Some(3.0), None, None];
        let found = runs(&times, &values);
        assert_eq!(found.len(), 2, "two lines: {found:?}");
        assert_eq!(found[0], [(0.0, 1.0), (1.0, 2.0)], "without the gap");
        assert_eq!(found[1].len(), 2, "a single value is a dash");
        let long: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut many = vec![Some(0.0); 10_000];
        many[7777] = Some(-5.0);
        let thinned = runs(&long, &many);
        assert!(thinned[0].len() <= MAX_POINTS, "{} points", thinned[0].len());
        assert!(thinned[0].iter().any(|point| point.1 < -4.0), "the peak is there");
    }

    #[test]
    fn ranges_have_a_width() {
        assert_eq!(span(&[]), 0.0..1.0, "no times");
        assert_eq!(span(&[2.0]), 2.0..3.0, "one time");
        let range = padded([-1.0, 3.0].into_iter());
        assert!(range.start < -1.0 && range.end > 3.0, "{range:?}");
        assert!(padded(std::iter::empty()).end > 0.0, "no values");
    }
}
