//! An image: culling of its triangles, the draw of their radiance with the sky behind them, and what is computed from it.

pub(crate) mod culling;
pub(crate) mod resources;
pub(crate) mod runs;
pub(crate) mod sampling;
pub(crate) mod variant;

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

pub(crate) use self::resources::RESOURCES;
use self::resources::{
    CRINKLED_X, CRINKLED_Y, CRINKLED_Z, DEPTH_IMAGE, DRAWN_IDENTITY, DRAWN_RADIANCE, DRAWS, EXPOSED_FINE,
    EXPOSED_IDENTITY, EXPOSED_RADIANCE, IDENTITY_IMAGE, IDENTITY_READBACK, IMAGE_IDENTITY, IMAGE_RADIANCE, MEAN,
    MEAN_DEPTH_IMAGE, MEAN_IMAGE, MULTI_IMAGE, RADIANCE_IMAGE, RADIANCE_READBACK, VISIBLE_TRIANGLES,
};
use self::runs::{TRIANGLES_A_DRAW, TriangleRun};
use self::sampling::{Distance, RowOf, Sampled, SubFrame};
use self::variant::RadianceVariant;
use super::sensor::FINE;
use super::thermal::NODE_READ;
use super::traced::{SURFACE, SURFACE_IMAGE};
use crate::gpu::pass::{
    Barrier, COLOUR, COMPUTE, COMPUTE_READ, COMPUTE_WRITE, COMPUTED, COPIED, COPY_READ, COPY_WRITE, DEPTH, DEPTH_WRITE,
    Drawing, Frame, Pass, barrier, scope, to_copy, to_draw, to_host,
};
use crate::gpu::resource::{Per, Resource};
use crate::gpu::shaders::Shader;
use crate::raster::places;

/// An image that a frame draws.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageRecipe {
    /// How the image is made. `None` if it is simply drawn.
    pub(crate) sampled: Option<Sampled>,
    /// What its pixels show.
    pub(crate) shows: RadianceVariant,
    /// Texels whose reflections of the craft itself are traced, where `shows` has them.
    pub(crate) texels: u32,
    /// The sub-frame of an exposure that it is, if it is one.
    pub(crate) sub_frame: Option<SubFrame>,
    /// Triangles to cull before each draw. Empty if the view of the craft has not changed since the last image.
    pub(crate) culled: Vec<TriangleRun>,
}

impl ImageRecipe {
    /// How it is computed from drawn images, if it is.
    pub(crate) fn resampled(&self) -> Option<Sampled> {
        self.sampled.filter(Sampled::is_resampled)
    }

    /// How a point finds its row with a rolling shutter.
    pub(crate) fn shutter(&self) -> Option<RowOf> {
        self.sampled.and_then(|sampled| sampled.shutter)
    }

    /// Samples of a texel of the mean over several samples, if it has one.
    fn mean(&self) -> Option<u32> {
        self.sampled.and_then(|sampled| sampled.mean)
    }

    /// Places in a pixel of the samples that are drawn one after another, the centre first. The only place of other images.
    fn places(&self) -> &'static [[f64; 2]] {
        places(self.sampled.map_or(1, |sampled| sampled.gathered))
    }

    /// The buffer to which reflections of the craft are added.
    fn lit(&self) -> &'static Resource {
        if self.resampled().and_then(|sampled| sampled.mean).is_some() { &MEAN } else { &DRAWN_RADIANCE }
    }

    /// Where radiance and identity of the image stand at the end.
    pub(crate) fn left_in(&self) -> [&'static Resource; 2] {
        match self.resampled() {
            Some(_) => [&IMAGE_RADIANCE, &IMAGE_IDENTITY],
            None if self.shows.traced => [&DRAWN_RADIANCE, &IDENTITY_IMAGE],
            None => [&RADIANCE_IMAGE, &IDENTITY_IMAGE],
        }
    }
}

/// Leaves triangles out that cover no pixel. For samples that are gathered these are the triangles that cover no sample at this place in a pixel, which are
/// many more.
fn cull(frame: &mut Frame, image: &ImageRecipe, place: Option<[f32; 2]>) {
    let mut pieces = image.culled.iter().flat_map(|run| run.pieces()).peekable();
    if pieces.peek().is_none() {
        return;
    }
    // The last draw may still read its triangles and draw commands.
    let indices = scope(S::INDEX_INPUT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
    let commands = scope(S::DRAW_INDIRECT | S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE);
    frame.wait([barrier(&VISIBLE_TRIANGLES, indices, COMPUTE_WRITE), barrier(&DRAWS, commands, COMPUTE_WRITE)]);
    let word = if place.is_some() { Some("gathered") } else { image.mean().map(|_| "sampled") };
    let words: Vec<_> = word.into_iter().chain(image.shutter().map(RowOf::words).unwrap_or_default()).collect();
    frame.passes_of(pieces.map(|run| {
        let (first, end) = run.triangles;
        let shader = Shader::new("cull.comp", words.clone());
        let pass = Pass::dispatch("cull", shader, (end - first).div_ceil(TRIANGLES_A_DRAW)).of_joint(run.joint);
        let pass = pass.over(Per::Triangle, run.triangles).over(Per::Draw, run.draws());
        match place {
            Some(place) => pass.told(&place).told(&first),
            None => pass.told(&first),
        }
    }));
    frame.wait([
        barrier(&VISIBLE_TRIANGLES, COMPUTE_WRITE, scope(S::INDEX_INPUT, A::INDEX_READ)),
        barrier(&DRAWS, COMPUTE_WRITE, scope(S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ)),
    ]);
}

/// Makes the image with the temperatures in the buffer `shown`, sample after sample. `traced` adds reflections of the craft to a buffer at a place in each
/// texel.
pub(crate) fn make(
    frame: &mut Frame,
    image: &ImageRecipe,
    shown: &'static Resource,
    traced: impl Fn(&mut Frame, [f32; 2], (&'static Resource, bool)),
) {
    let vertex = scope(S::VERTEX_SHADER, A::SHADER_STORAGE_READ);
    let places = image.places();
    for (number, place) in places.iter().map(|place| place.map(|share| share as f32)).enumerate() {
        let gathered = (places.len() > 1).then_some(place);
        cull(frame, image, gathered);
        if number == 0 {
            frame.wait([barrier(shown, COMPUTE_WRITE, if image.shows.traced { NODE_READ } else { vertex })]);
        }
        draw(frame, image, shown, gathered);
        compute(frame, image, (number, places.len()), |frame, lit| traced(frame, place, lit));
    }
}

/// Draws one sample of each texel, at a place in it where samples are gathered, and the mean over several where a finer image has one.
fn draw(frame: &mut Frame, image: &ImageRecipe, shown: &'static Resource, place: Option<[f32; 2]>) {
    let (shows, mean, shutter) = (image.shows, image.mean(), image.shutter());
    let mut before = vec![
        to_draw(&RADIANCE_IMAGE, COPIED, COLOUR),
        to_draw(&IDENTITY_IMAGE, COPIED, COLOUR),
        to_draw(&DEPTH_IMAGE, DEPTH_WRITE, DEPTH),
    ];
    let mut drawn = vec![to_copy(&RADIANCE_IMAGE, COLOUR), to_copy(&IDENTITY_IMAGE, COLOUR)];
    if shows.traced {
        before.push(to_draw(&SURFACE_IMAGE, COPIED, COLOUR));
        drawn.push(to_copy(&SURFACE_IMAGE, COLOUR));
    }
    // A mean takes the place of the radiance of single samples.
    let single = match image.sampled {
        // The sky stands behind the pixels, not behind the texels of a crop.
        Some(Sampled { distance: Distance::Far, .. }) => {
            RadianceVariant { background: false, in_pixels: false, ..shows }
        }
        _ if mean.is_some() => RadianceVariant::PLAIN,
        // The texels of a finer image are no pixels.
        Some(Sampled { lens: true, .. }) => RadianceVariant { in_pixels: false, ..shows },
        _ => shows,
    };
    let mut passes = vec![draw_pass(single, (None, place), shutter, shown)];
    if let Some(each) = mean {
        before.push(to_draw(&MEAN_IMAGE, COPIED, COLOUR));
        before.push(to_draw(&MEAN_DEPTH_IMAGE, DEPTH_WRITE, DEPTH));
        if each > 1 {
            // Only draws use this image.
            before.push(to_draw(&MULTI_IMAGE, COLOUR, COLOUR));
        }
        passes.push(draw_pass(shows, (Some(each), None), shutter, shown));
        drawn.push(to_copy(&MEAN_IMAGE, COLOUR));
    }
    frame.wait(before);
    frame.passes_of(passes);
    frame.wait(drawn);
}

/// Copies drawn images to buffers, where another image is computed from them or reflections of the craft are added. `traced`
/// adds these. The drawn image is the sample `number` of so many.
fn compute(
    frame: &mut Frame,
    image: &ImageRecipe,
    (number, count): (usize, usize),
    traced: impl FnOnce(&mut Frame, (&'static Resource, bool)),
) {
    let (resampled, shows, lit) = (image.resampled(), image.shows, image.lit());
    if resampled.is_none() && !shows.traced {
        return;
    }
    let copies: Vec<(&str, &'static Resource, &'static Resource)> = [
        Some(("copy radiance", &RADIANCE_IMAGE, &DRAWN_RADIANCE)),
        resampled.map(|_| ("copy identity", &IDENTITY_IMAGE, &DRAWN_IDENTITY)),
        resampled.and_then(|sampled| sampled.mean).map(|_| ("copy mean", &MEAN_IMAGE, &MEAN)),
        shows.traced.then_some(("copy surfaces", &SURFACE_IMAGE, &SURFACE)),
    ]
    .into_iter()
    .flatten()
    .collect();
    // The passes of the last image may still use the buffers that this one replaces.
    let used = scope(S::COMPUTE_SHADER | S::COPY, A::SHADER_STORAGE_WRITE);
    frame.wait(copies.iter().map(|(_, _, to)| barrier(to, used, COPY_WRITE)));
    frame.passes_of(copies.iter().map(|(name, from, to)| Pass::copy(name, from, to)));
    let read = |to: &'static Resource| if shows.traced && *to == *lit { COMPUTE } else { COMPUTE_READ };
    let mut waits: Vec<Barrier> = copies.iter().map(|(_, _, to)| barrier(to, COPY_WRITE, read(to))).collect();
    if shows.traced {
        frame.wait(std::mem::take(&mut waits));
        traced(frame, (lit, *lit == MEAN));
        waits.push(barrier(lit, COMPUTE_WRITE, if resampled.is_some() { COMPUTE_READ } else { COPY_READ }));
    }
    let Some(sampled) = resampled else {
        frame.wait(waits);
        return;
    };
    // A copy, or a sub-frame of an exposure, may still read the last image.
    let read = scope(S::COMPUTE_SHADER | S::COPY, A::NONE);
    let [before, after] = if number == 0 { [read, COMPUTE_WRITE] } else { [COMPUTE_WRITE, COMPUTE] };
    waits.extend([&IMAGE_RADIANCE, &IMAGE_IDENTITY].map(|made| barrier(made, before, after)));
    // The sensor may still read the texels of the last image.
    waits.extend(sampled.fine.then(|| barrier(&FINE, COMPUTED, COMPUTE_WRITE)));
    frame.wait(waits);
    frame.pass(if sampled.distance == Distance::Far {
        let sky = shows.background;
        let words = [(sky, "sky"), (sky && shows.sun, "sun"), (sky && shows.map, "map"), (sampled.fine, "fine")];
        Pass::dispatch("distant", Shader::with("distant.comp", &words), sampled.rows)
    } else if count > 1 || (sampled.mean.is_none() && !sampled.lens) {
        let shader = Shader::with("gather.comp", &[(number == 0, "first")]);
        Pass::dispatch("gather", shader, sampled.rows).told(&(1.0 / count as f32))
    } else {
        let words = [(sampled.lens, "lens"), (sampled.mean.is_some(), "several"), (sampled.fine, "fine")];
        Pass::dispatch("resample", Shader::with("resample.comp", &words), sampled.rows)
    });
    if number + 1 == count && image.sub_frame.is_none() {
        frame.wait([&IMAGE_RADIANCE, &IMAGE_IDENTITY].map(|made| barrier(made, COMPUTE_WRITE, COPY_READ)));
    }
}

/// Adds a sub-frame to its exposure. The last one becomes the image.
pub(crate) fn expose(frame: &mut Frame, image: &ImageRecipe) {
    let (Some(sub_frame), Some(sampled)) = (image.sub_frame, image.resampled()) else { return };
    let is_last = sub_frame.is_last();
    let kept = [&EXPOSED_RADIANCE, &EXPOSED_IDENTITY, &EXPOSED_FINE];
    let kept = &kept[..if sampled.fine { 3 } else { 2 }];
    let drawn = [&IMAGE_RADIANCE, &IMAGE_IDENTITY, &FINE];
    let drawn = &drawn[..kept.len()];
    let mut waits: Vec<Barrier> = drawn.iter().map(|made| barrier(made, COMPUTE_WRITE, COMPUTE)).collect();
    waits.extend(kept.iter().map(|sum| barrier(sum, COMPUTE_WRITE, COMPUTE)));
    frame.wait(waits);
    let texels = sampled.fine.then_some(true);
    for texels in std::iter::once(false).chain(texels) {
        let words = [(texels, "texels"), (sub_frame.number == 0, "first"), (is_last, "last")];
        let name = if texels { "expose texels" } else { "expose" };
        let pass = Pass::dispatch(name, Shader::with("expose.comp", &words), sampled.rows);
        frame.pass(pass.told(&(1.0 / sub_frame.count as f32)));
    }
    if is_last {
        frame.wait([&IMAGE_RADIANCE, &IMAGE_IDENTITY].map(|made| barrier(made, COMPUTE_WRITE, COPY_READ)));
    }
}

/// Copies the image to the host.
pub(crate) fn read(frame: &mut Frame, image: &ImageRecipe) {
    let [radiance, identity] = image.left_in();
    frame.pass(Pass::copy("read radiance", radiance, &RADIANCE_READBACK));
    frame.pass(Pass::copy("read identity", identity, &IDENTITY_READBACK));
    frame.wait([to_host(&RADIANCE_READBACK), to_host(&IDENTITY_READBACK)]);
}

/// Draws the triangles that culling kept, and the sky behind them. `mean` are the samples of a texel of a mean, and `place` is the place of a sample that is gathered.
fn draw_pass(
    shows: RadianceVariant,
    (mean, place): (Option<u32>, Option<[f32; 2]>),
    shutter: Option<RowOf>,
    temperature: &'static Resource,
) -> Pass {
    let mut colours: Vec<(&'static Resource, Option<&'static Resource>)> = match mean {
        None => vec![(&RADIANCE_IMAGE, None), (&IDENTITY_IMAGE, None)],
        Some(1) => vec![(&MEAN_IMAGE, None)],
        Some(_) => vec![(&MULTI_IMAGE, Some(&MEAN_IMAGE))],
    };
    colours.extend(shows.traced.then_some((&SURFACE_IMAGE, None)));
    let (name, depth) = if mean.is_some() { ("mean", &MEAN_DEPTH_IMAGE) } else { ("radiance", &DEPTH_IMAGE) };
    let drawing = Drawing {
        shaders: craft_shaders(shows, mean, place.is_some(), shutter),
        behind: if shows.background { sky_shaders(shows, mean, place.is_some(), shutter) } else { Vec::new() },
        colours,
        depth,
        samples: mean.unwrap_or(1),
        indices: &VISIBLE_TRIANGLES,
        commands: &DRAWS,
        constants: Vec::new(),
    };
    let pass = Pass::draw(name, drawing).instead("Temperature", temperature);
    let pass = if let Some(place) = place { pass.told(&place) } else { pass };
    if !shows.crinkled {
        return pass;
    }
    pass.instead("NormalX", &CRINKLED_X).instead("NormalY", &CRINKLED_Y).instead("NormalZ", &CRINKLED_Z)
}

/// The vertex shader and the fragment shader of the craft.
fn craft_shaders(shows: RadianceVariant, mean: Option<u32>, gathered: bool, shutter: Option<RowOf>) -> Vec<Shader> {
    let several = mean.is_some_and(|each| each > 1);
    let words =
        [(shows.needs_normals(), "normals"), (several, "multiple"), (shows.traced, "traced"), (gathered, "gathered")];
    let mut vertex = Shader::with("radiance.vert", &words);
    vertex.words.extend(shutter.map(RowOf::words).unwrap_or_default());
    let words = [
        (shows.reflections, "reflections"),
        (shows.rough, "rough"),
        (shows.smooth, "smooth"),
        (shows.traced, "traced"),
        (shows.reflections && shows.sun, "sun"),
        (shows.apart, "apart"),
        (shows.tables, "tables"),
        (shows.reflections && shows.map, "map"),
        (mean.is_some(), "mean"),
        (several, "multiple"),
        (shows.in_pixels && mean.is_none(), "in_pixels"),
    ];
    let mut fragment = Shader::with("radiance.frag", &words);
    fragment.words.extend(shutter.filter(|_| shows.reflections).map(RowOf::words).unwrap_or_default());
    vec![vertex, fragment]
}

/// The vertex shader and the fragment shader of the sky.
fn sky_shaders(shows: RadianceVariant, mean: Option<u32>, gathered: bool, shutter: Option<RowOf>) -> Vec<Shader> {
    let several = mean.is_some_and(|each| each > 1);
    let words = [
        (shows.traced, "traced"),
        (shows.sun, "sun"),
        (shows.map, "map"),
        (mean.is_some(), "mean"),
        (several, "multiple"),
        (gathered, "gathered"),
    ];
    let mut fragment = Shader::with("background.frag", &words);
    fragment.words.extend(shutter.map(RowOf::words).unwrap_or_default());
    vec![Shader::plain("background.vert"), fragment]
}
