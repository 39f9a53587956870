//! A sheet of some samples with boxes, key points and axes, and histograms, so that a wrong SPEC is seen in seconds.

use std::sync::atomic::AtomicBool;

use embedded_graphics::Drawable;
use embedded_graphics::geometry::Point;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::primitives::{Circle, Line, Primitive, PrimitiveStyle, Rectangle};
use embedded_graphics::text::Alignment;
use glam::{DVec2, DVec3};

use super::error::DatasetError;
use super::orbit::{OrbitRun, Rejections};
use super::row::{phase_angle_deg, row};
use super::scene_values::SceneText;
use super::spec::Spec;
use crate::labels::craft::Craft;
use crate::labels::image::LabelledImage;
use crate::labels::key_points::{Visibility, seen};
use crate::output::canvas::{Canvas, FontFace, Rgb};
use crate::output::colour::ColourScale;
use crate::output::picture::{Tile, contact_sheet};
use crate::output::ticks;
use crate::simulation::target::Target;

/// Number of samples on a sheet.
pub(crate) const SAMPLES: u64 = 24;
/// Most orbits that are run for it.
const ORBITS: u64 = 4;
/// Tiles in a row, and their width [px].
const COLUMNS: u32 = 6;
const WIDTH: u32 = 240;
/// Height of the histograms [px], and their number of bars.
const HISTOGRAM: u32 = 150;
const BARS: usize = 24;

const BOX: Rgb = [90, 220, 255];
const SEEN: Rgb = [80, 255, 120];
const HIDDEN: Rgb = [255, 120, 60];
const AXES: [Rgb; 3] = [[255, 70, 70], [70, 255, 70], [110, 140, 255]];
const INK: Rgb = [25, 28, 32];
const BAR: Rgb = [72, 105, 160];

/// A sheet, and how many attempts were rejected.
pub struct Preview {
    /// The picture.
    pub canvas: Canvas,
    /// Number of the samples on it.
    pub samples: usize,
    pub(crate) rejections: Rejections,
    /// What is probably wrong in the first scene.
    pub(crate) warnings: Vec<String>,
}

/// Draws the sheet of a SPEC. `progress` is called for each sample.
///
/// # Errors
/// As for making the data set.
pub fn preview(
    spec: &Spec,
    scenes: &SceneText,
    target: &Target,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(),
) -> Result<Preview, DatasetError> {
    scenes.check_ends(spec)?;
    let orbits = spec.orbits().min(ORBITS);
    let (mut rejections, mut warnings) = (Rejections::new(), Vec::new());
    let mut samples: Vec<(LabelledImage, Vec<Overlay>)> = Vec::new();
    for place in 0..orbits {
        // Orbits and images lie evenly over the data set.
        let orbit = place * spec.orbits() / orbits;
        let images = spec.images_of(orbit);
        let count = images.end - images.start;
        let wanted = (SAMPLES / orbits).min(count);
        let chosen: Vec<u64> = (0..wanted).map(|number| images.start + number * count / wanted).collect();
        let mut run = OrbitRun::new(spec, scenes, target, orbit)?;
        if place == 0 {
            run.check_symmetries()?;
            warnings = run.warnings();
        }
        let outcome = run.run(&|image| chosen.contains(&image), stop, &mut |craft, _, _, labelled| {
            let overlays = overlays(craft, &labelled);
            samples.push((labelled, overlays));
            progress();
            Ok(())
        })?;
        if outcome.stopped {
            return Err(DatasetError::StoppedBefore);
        }
        for (reason, count) in outcome.rejections {
            *rejections.entry(reason).or_default() += count;
        }
    }
    Ok(Preview { canvas: sheet(spec, &samples), samples: samples.len(), rejections, warnings })
}

/// Something that is drawn on a tile, in pixels of the image.
enum Overlay {
    Line(DVec2, DVec2, Rgb),
    Dot(DVec2, Rgb),
    Box([f64; 4]),
}

fn overlays(craft: &Craft, image: &LabelledImage) -> Vec<Overlay> {
    let mut all = Vec::new();
    let row = row(image, &[]);
    let bounds = ["box_x_px", "box_y_px", "box_width_px", "box_height_px"];
    all.push(Overlay::Box(bounds.map(|key| row.get(key).and_then(serde_json::Value::as_f64).unwrap_or(0.0))));
    let radius = craft.positions.iter().map(|place| place.length()).fold(0.0, f64::max);
    let to_pixel =
        |place: DVec3| image.project(image.camera_from_body.transform_point3(place)).map(|pixel| pixel + 0.5);
    for (axis, colour) in DVec3::AXES.into_iter().zip(AXES) {
        if let (Some(from), Some(to)) = (to_pixel(DVec3::ZERO), to_pixel(axis * 0.5 * radius)) {
            all.push(Overlay::Line(from, to, colour));
        }
    }
    for point in seen(&craft.key_points, image) {
        let colour = if point.visibility == Visibility::Visible { SEEN } else { HIDDEN };
        if point.visibility != Visibility::Outside {
            all.extend(point.pixel.map(|pixel| Overlay::Dot(pixel + 0.5, colour)));
        }
    }
    all
}

fn sheet(spec: &Spec, samples: &[(LabelledImage, Vec<Overlay>)]) -> Canvas {
    let ranges = samples.iter().filter_map(|(image, _)| range(image));
    let scale = ColourScale::covering(ranges);
    let tiles: Vec<Tile> = samples.iter().map(|(image, overlays)| tile(image, overlays, &scale)).collect();
    let title = format!(
        "{}: {} images of {} orbits",
        spec.path.file_name().unwrap_or_default().to_string_lossy(),
        spec.samples,
        spec.orbits()
    );
    let details =
        "surface temperature; box, body axes (x red, y green, z blue), key points (green seen, orange hidden)";
    let pictures = contact_sheet(&tiles, COLUMNS, &scale, &title, details);
    let mut sheet = Canvas::new(pictures.width(), pictures.height() + HISTOGRAM + 60, [255; 3]);
    sheet.paste(&pictures, 0, 0, 1);
    let distances = samples.iter().map(|(image, _)| image.camera_from_body.translation.length()).collect();
    let angles = samples.iter().map(|(image, _)| phase_angle_deg(image)).collect();
    let temperatures = samples
        .iter()
        .flat_map(|(image, _)| {
            image.channels.temperature.iter().zip(&image.channels.part).filter(|(_, part)| **part != 0)
        })
        .map(|(kelvin, _)| f64::from(*kelvin))
        .collect();
    let width = pictures.width() / 3;
    let histograms: [(&str, Vec<f64>); 3] = [
        ("distance [m], samples", distances),
        ("phase angle [deg], samples", angles),
        ("surface temperature [K], pixels", temperatures),
    ];
    for (place, (name, values)) in (0..).zip(histograms) {
        histogram(&mut sheet, [place * width + 20, pictures.height()], width - 40, name, &values);
    }
    sheet
}

/// Least and greatest temperature of the craft [K].
fn range(image: &LabelledImage) -> Option<[f32; 2]> {
    let shown = image.channels.temperature.iter().zip(&image.channels.part).filter(|(_, part)| **part != 0);
    shown.map(|(kelvin, _)| [*kelvin; 2]).reduce(|[low, high], [kelvin, _]| [low.min(kelvin), high.max(kelvin)])
}

fn tile(image: &LabelledImage, overlays: &[Overlay], scale: &ColourScale) -> Tile {
    let colours = image
        .channels
        .temperature
        .iter()
        .zip(&image.channels.part)
        .map(|(kelvin, part)| if *part == 0 { crate::output::colour::BACKGROUND } else { scale.colour(*kelvin) });
    let whole = Canvas::from_pixels(image.width, image.height, colours.collect());
    let width = WIDTH.min(image.width).max(1);
    let zoom = f64::from(width) / f64::from(image.width);
    let mut small = whole.resized(width, (f64::from(image.height) * zoom).round().max(1.0) as u32);
    let place = |pixel: DVec2| Point::new((pixel.x * zoom).round() as i32, (pixel.y * zoom).round() as i32);
    for overlay in overlays {
        // A canvas takes everything that is drawn on it.
        let Ok(()) = match overlay {
            Overlay::Line(from, to, colour) => Line::new(place(*from), place(*to))
                .into_styled(PrimitiveStyle::with_stroke(rgb(*colour), 1))
                .draw(&mut small),
            Overlay::Dot(at, colour) => {
                Circle::with_center(place(*at), 4).into_styled(PrimitiveStyle::with_fill(rgb(*colour))).draw(&mut small)
            }
            Overlay::Box([x, y, width, height]) => {
                let corners = [place(DVec2::new(*x, *y)), place(DVec2::new(x + width, y + height))];
                let style = PrimitiveStyle::with_stroke(rgb(BOX), 1);
                Rectangle::with_corners(corners[0], corners[1]).into_styled(style).draw(&mut small)
            }
        };
    }
    let distance = image.camera_from_body.translation.length();
    let caption = format!(
        "{} {} {distance:.2} m, {:.0} deg{}",
        image.identity.split.name(),
        image.identity.sample,
        phase_angle_deg(image),
        if image.lit < 1.0 { ", eclipse" } else { "" }
    );
    Tile::drawn(&caption, small, range(image))
}

fn rgb([r, g, b]: Rgb) -> Rgb888 {
    Rgb888::new(r, g, b)
}

/// Draws a histogram with its title above and its ends below.
fn histogram(sheet: &mut Canvas, [left, top]: [u32; 2], width: u32, name: &str, values: &[f64]) {
    sheet.text(name, left, top, FontFace::Normal, Alignment::Left, INK);
    let ends = values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(*value), high.max(*value)]);
    if !(ends[0].is_finite() && ends[1].is_finite()) {
        return;
    }
    let [low, high] = ticks::round_range(ends[0], ends[1]);
    let mut counts = [0u32; BARS];
    for value in values {
        let bar = ((value - low) / (high - low) * BARS as f64) as usize;
        counts[bar.min(BARS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1);
    let (base, bar) = (top + 20 + HISTOGRAM, width / BARS as u32);
    for (place, count) in (0..).zip(counts) {
        let height = (u64::from(count) * u64::from(HISTOGRAM) / u64::from(most)) as u32;
        sheet.fill(left + place * bar, base - height, bar.saturating_sub(1), height, BAR);
    }
    sheet.fill(left, base, bar * BARS as u32, 1, INK);
    let step = (high - low) / BARS as f64;
    sheet.text(&ticks::label(low, step), left, base + 4, FontFace::Small, Alignment::Left, INK);
    sheet.text(&ticks::label(high, step), left + bar * BARS as u32, base + 4, FontFace::Small, Alignment::Right, INK);
    sheet.text(
        &format!("most: {most}"),
        left + bar * BARS as u32 / 2,
        base + 4,
        FontFace::Small,
        Alignment::Center,
        INK,
    );
}
