//! The pictures of a run, drawn from its EXR files after the last step.

use rayon::prelude::*;

use super::OutputError;
use super::apparent::Apparent;
use super::colour::ColourScale;
use super::eclipses::Eclipses;
use super::exr::read_exr;
use super::folder::Folder;
use super::picture::{Tile, contact_sheet, picture};
use super::report::{FrameEntry, Picture};
use crate::scene::{ImageFile, Scene};

/// Small pictures of several steps.
pub(super) const CONTACT_SHEET: &str = "contact_sheet.png";
/// Most pictures on the contact sheet.
const MOST_TILES: usize = 12;
/// Width of a picture on the contact sheet [px].
const TILE_WIDTH: u32 = 320;

/// A frame in the output folder.
pub(super) struct WrittenFrame {
    /// Its step.
    pub step: u32,
    /// Its smallest and largest temperature [K].
    pub range: Option<[f32; 2]>,
    /// Its smallest and largest apparent temperature [K], where they are drawn.
    pub apparent: Option<[f32; 2]>,
}

/// File of a drawn step.
pub(super) fn frame_file(step: u32, kind: &str) -> String {
    format!("frames/{}.{kind}", frame_stem(step))
}

/// Start of the names of a drawn step's files.
pub(super) fn frame_stem(step: u32) -> String {
    format!("step_{step:06}")
}

/// Draws a PNG for each frame on one scale, and the contact sheet. `drawn` is called after each picture.
pub(super) fn draw_pictures(
    scene: &Scene,
    eclipses: &Eclipses,
    folder: &Folder,
    written: &[WrittenFrame],
    drawn: &(dyn Fn() + Sync),
) -> Result<(Vec<FrameEntry>, Vec<Picture>), OutputError> {
    let scale = match scene.colour_range {
        Some(range) => ColourScale::new(range),
        None => ColourScale::covering(written.iter().filter_map(|frame| frame.range)),
    };
    let apparent = scene.images.files.contains(&ImageFile::ApparentPng).then(|| Apparent::new(scene.band));
    let apparent_scale = match scene.colour_range {
        Some(range) => ColourScale::new(range),
        None => ColourScale::covering(written.iter().filter_map(|frame| frame.apparent)),
    };
    let name = &scene.name;
    let band = scene.band;
    let chosen = |index: usize| {
        let tiles = written.len().min(MOST_TILES);
        (0..tiles).any(|tile| tile * written.len() / tiles == index)
    };
    let pictured: Vec<(FrameEntry, Option<Tile>)> = written
        .par_iter()
        .enumerate()
        .map(|(index, one)| {
            let time = f64::from(one.step) * scene.time.step;
            let exr = frame_file(one.step, "exr");
            let (frame, _) = read_exr(&folder.file(&exr))?;
            let light = eclipses.at(time).map_or(String::new(), |name| format!(", {name}"));
            let details = format!("step {}, t = {time:.1} s{light}, band {band}", one.step);
            let file = frame_file(one.step, "png");
            folder.write_bytes(&file, &picture(&frame, &scale, name, &details)?.png()?)?;
            if let Some(apparent) = &apparent {
                let file = format!("frames/{}_apparent.png", frame_stem(one.step));
                let details = format!("apparent, {details}");
                folder
                    .write_bytes(&file, &picture(&apparent.frame(&frame), &apparent_scale, name, &details)?.png()?)?;
            }
            let caption = format!("t = {time:.0} s{light}");
            let tile = chosen(index).then(|| Tile::new(&frame, &scale, &caption, TILE_WIDTH)).transpose()?;
            drawn();
            let entry = FrameEntry { step: one.step, time_s: time, file: exr, picture: Some(file) };
            Ok((entry, tile))
        })
        .collect::<Result<_, OutputError>>()?;
    let (frames, tiles): (Vec<FrameEntry>, Vec<Option<Tile>>) = pictured.into_iter().unzip();
    let tiles: Vec<Tile> = tiles.into_iter().flatten().collect();
    if tiles.is_empty() {
        return Ok((frames, Vec::new()));
    }
    let details = format!("{} of {} images", tiles.len(), written.len());
    let png = contact_sheet(&tiles, 4, &scale, name, &details).png()?;
    folder.write_bytes(CONTACT_SHEET, &png)?;
    let title = "Surface temperature through the run".to_owned();
    let sheet = Picture { title, file: CONTACT_SHEET.to_owned(), png };
    Ok((frames, vec![sheet]))
}
