//! Buffers and images of an image: camera, surroundings, geometry, render targets and readback.

use super::runs::CORNERS;
use crate::gpu::effects::thermal::axis;
use crate::gpu::layout;
use crate::gpu::pipeline::{IDENTITY_FORMAT, MEAN_FORMAT, RADIANCE_FORMAT};
use crate::gpu::resource::Pieces::{Always, WithoutImage};
use crate::gpu::resource::Role::{Colour, Commands, Depth, FromHost, Readback, Storage, Uniform, WrittenIndices};
use crate::gpu::resource::{GROUP, Per, Resource, lent, made, resources};
use crate::gpu::scene_data::{SceneData, area, only};
use crate::thermal::sensor::spread::FINENESS;

resources! {
    /// `View`, written by the host.
    VIEW = Resource::uniform::<layout::View>("View", |_| 1).each_joint();
    /// `Surroundings` of the image, written by the host.
    SURROUNDINGS = Resource::uniform::<layout::Surroundings>("Surroundings", |data| {
        only(data.draws() && data.shown.variant.sees_surroundings(), 1)
    });
    /// `Reflector` of both faces of every material.
    REFLECTORS = Resource::new("Reflectors", size_of::<layout::Reflector>(), Storage, Per::Scene, |data| {
            data.if_drawn(data.shown.reflectors.len())
        })
        .filled(|data| lent(data.shown.reflectors));
    /// Lobes of rough mirrors before the planet, written by the host.
    LOBES = Resource::new("Lobes", 4, FromHost, Per::Scene, |data| data.if_drawn(data.shown.lobe_values)).each_slot();
    /// Emissivities of the faces over angle and temperature.
    EMISSIVITIES =
        Resource::new("Emissivities", 4, Storage, Per::Scene, |data| data.if_drawn(data.shown.emissivities.len()))
            .filled(|data| lent(data.shown.emissivities));
    /// `PlanetView` of the image, written by the host.
    PLANET_VIEW =
        Resource::uniform::<layout::PlanetView>("PlanetView", |data| only(data.draws() && data.shown.variant.map, 1));
    /// Radiances of a planet that is not uniform, over the radiance of its mean temperature.
    PLANET_MAP = Resource::new("PlanetMap", 4, Storage, Per::Scene, |data| data.if_drawn(data.shown.planet_map.len()))
            .filled(|data| lent(data.shown.planet_map));
    /// Its means over the direction of a surface, written by the host.
    PLANET_MEANS =
        Resource::new("PlanetMeans", 4, FromHost, Per::Scene, |data| data.if_drawn(data.shown.planet_means))
            .each_slot();
    /// `PixelChanges` of the image, written by the host.
    PIXEL_CHANGES = Resource::new("PixelChanges", 8, FromHost, Per::Pixel, |data| {
            only(data.draws() && data.shown.variant.in_pixels, 1 + pixels(data))
        })
        .each_slot();
    /// Part index of every group.
    GROUP_PART = Resource::new("GroupPart", 4, Storage, Per::Node, |data| data.if_drawn(data.groups()))
            .in_pieces(WithoutImage)
            .filled(|data| lent(data.group_part));
    /// x of the normals of crinkled foil that is drawn.
    CRINKLED_X =
        Resource::new("CrinkledX", GROUP, Storage, Per::Node, crinkled_groups)
            .filled(|data| axis(data.shown.crinkled, 0));
    /// y of these normals.
    CRINKLED_Y =
        Resource::new("CrinkledY", GROUP, Storage, Per::Node, crinkled_groups)
            .filled(|data| axis(data.shown.crinkled, 1));
    /// z of these normals.
    CRINKLED_Z =
        Resource::new("CrinkledZ", GROUP, Storage, Per::Node, crinkled_groups)
            .filled(|data| axis(data.shown.crinkled, 2));
    /// x of the positions [m].
    POSITION_X =
        Resource::new("PositionX", GROUP, Storage, Per::Node, placed_groups).filled(|data| axis(data.positions, 0));
    /// y of the positions [m].
    POSITION_Y =
        Resource::new("PositionY", GROUP, Storage, Per::Node, placed_groups).filled(|data| axis(data.positions, 1));
    /// z of the positions [m].
    POSITION_Z =
        Resource::new("PositionZ", GROUP, Storage, Per::Node, placed_groups).filled(|data| axis(data.positions, 2));
    /// Node indices of the triangles.
    TRIANGLES = Resource::new("Triangles", CORNERS, Storage, Per::Triangle, |data| data.if_drawn(data.triangles.len()))
            .in_pieces(Always)
            .filled(|data| lent(data.triangles.as_flattened()));
    /// Triangles that culling kept, at the front of the triangles of each draw.
    VISIBLE_TRIANGLES = Resource::new("VisibleTriangles", CORNERS, WrittenIndices, Per::Triangle, |data| {
            data.if_drawn(data.triangles.len())
        })
        .in_pieces(Always);
    /// One `DrawCommand` for each run of `VISIBLE_TRIANGLES`.
    DRAWS = Resource::new("Draws", size_of::<layout::DrawCommand>(), Commands, Per::Draw, |data| {
        data.if_drawn(data.runs().iter().map(|run| run.draws().1 as usize).max().unwrap_or(0))
    })
    .in_pieces(Always)
    .filled(|data| made(&super::runs::whole_draws(&data.runs())));
    /// Table of the band's radiance.
    BAND_TABLE = Resource::new("BandTable", 4, Storage, Per::Scene, |data| data.band_table.len())
        .filled(|data| lent(data.band_table));
    /// Radiance, temperature and depth of every pixel.
    RADIANCE_IMAGE =
        Resource::image("RadianceImage", 16, Colour(RADIANCE_FORMAT), Per::Pixel, drawn_texels, drawn_singly);
    /// Part and material index of every pixel.
    IDENTITY_IMAGE =
        Resource::image("IdentityImage", 8, Colour(IDENTITY_FORMAT), Per::Pixel, drawn_texels, drawn_singly);
    /// Depth buffer.
    DEPTH_IMAGE = Resource::image("DepthImage", 4, Depth, Per::Pixel, drawn_texels, drawn_singly);
    /// `Shutter`, written by the host.
    SHUTTER = Resource::uniform::<layout::Shutter>("Shutter", |data| {
        data.of_sampling(|sampling| usize::from(sampling.shutter.is_some()))
    })
    .each_joint();
    /// `ShutterSky`, written by the host.
    SHUTTER_SKY = Resource::uniform::<layout::ShutterSky>("ShutterSky", |data| {
        let seen = data.shown.variant.background || data.shown.variant.reflections;
        data.of_sampling(|sampling| usize::from(sampling.shutter.is_some() && seen))
    });
    /// `Distant`, written by the host.
    DISTANT = Resource::uniform::<layout::Distant>("Distant", |data| {
        data.of_sampling(|sampling| usize::from(sampling.distant))
    });
    /// Sizes of an image that is computed from drawn ones.
    SAMPLING =
        Resource::new("Sampling", size_of::<layout::Sampling>(), Uniform, Per::Scene, |data| data.of_computed(|_| 1))
            .filled(|data| match (&data.sampling, data.image) {
                (Some(sampling), Some(image)) => made(&[sampling.sizes(image)]),
                _ => Default::default(),
            });
    /// Copy of `RADIANCE_IMAGE` that shaders read, and to which reflections of the craft are added.
    DRAWN_RADIANCE = Resource::new("DrawnRadiance", 16, Storage, Per::Texel, |data| {
        let traced = only(data.shown.variant.traced, drawn_texels(data));
        data.of_computed(|sampling| area(sampling.drawn)).max(traced)
    });
    /// Copy of `IDENTITY_IMAGE` that shaders read.
    DRAWN_IDENTITY = Resource::new("DrawnIdentity", 8, Storage, Per::Pixel, |data| {
        data.of_computed(|sampling| area(sampling.drawn))
    });
    /// Mean radiance and coverage of every texel over its samples.
    MEAN_IMAGE = Resource::image("MeanImage", 8, Colour(MEAN_FORMAT), Per::Pixel, mean_texels, drawn_largest);
    /// `MEAN_IMAGE` before the mean over the samples of a texel.
    MULTI_IMAGE = Resource::image(
        "MultiImage",
        8,
        Colour(MEAN_FORMAT),
        Per::Sample,
        |data| data.of_mean(|mean| only(mean.each > 1, area(mean.size) * mean.each as usize)),
        drawn_largest,
    );
    /// Depth buffer of `MEAN_IMAGE` or `MULTI_IMAGE`.
    MEAN_DEPTH_IMAGE = Resource::image(
        "MeanDepthImage",
        4,
        Depth,
        Per::Sample,
        |data| data.of_mean(|mean| area(mean.size) * mean.each as usize),
        drawn_largest,
    );
    /// Copy of `MEAN_IMAGE` that shaders read, and to which reflections of the craft are added.
    MEAN = Resource::new("Mean", 8, Storage, Per::Texel, mean_texels);
    /// Places of the pixels' corners in the finer image of a distorting lens.
    LENS_MAP = Resource::new("LensMap", 8, Storage, Per::Pixel, |data| data.of_sampling(|sampling| sampling.map.len()))
            .filled(|data| data.sampling.as_ref().map_or_else(Default::default, |sampling| lent(&sampling.map)));
    /// Radiance, temperature, depth and coverage of every pixel of an image that is computed from drawn ones.
    IMAGE_RADIANCE = Resource::new("ImageRadiance", 16, Storage, Per::Pixel, computed_pixels);
    /// Part and material of every pixel of such an image.
    IMAGE_IDENTITY = Resource::new("ImageIdentity", 8, Storage, Per::Pixel, computed_pixels);
    /// Sum of the sub-frames of an exposure so far, as `IMAGE_RADIANCE`.
    EXPOSED_RADIANCE = Resource::new("ExposedRadiance", 16, Storage, Per::Pixel, exposed_pixels);
    /// Part and material of every pixel of it.
    EXPOSED_IDENTITY = Resource::new("ExposedIdentity", 8, Storage, Per::Pixel, exposed_pixels);
    /// Sum of the texels in its pixels, where a point spread reads them.
    EXPOSED_FINE = Resource::new("ExposedFine", 16, Storage, Per::Pixel, |data| {
        data.of_sampling(|sampling| only(sampling.exposed && sampling.fine, FINENESS * pixels(data)))
    });
    /// Host copy of the radiance of every pixel.
    RADIANCE_READBACK = Resource::new("RadianceReadback", 16, Readback, Per::Pixel, pixels).each_slot();
    /// Host copy of part and material of every pixel.
    IDENTITY_READBACK = Resource::new("IdentityReadback", 8, Readback, Per::Pixel, pixels).each_slot();
}

fn crinkled_groups(data: &SceneData<'_>) -> usize {
    data.if_drawn(data.shown.crinkled.len() / crate::model::nodes::GROUP)
}

/// Groups, if anything is drawn.
fn placed_groups(data: &SceneData<'_>) -> usize {
    only(data.draws(), data.groups())
}

fn pixels(data: &SceneData<'_>) -> usize {
    data.image.map_or(0, area)
}

fn computed_pixels(data: &SceneData<'_>) -> usize {
    data.of_computed(|_| pixels(data))
}

fn exposed_pixels(data: &SceneData<'_>) -> usize {
    data.of_sampling(|sampling| only(sampling.exposed, pixels(data)))
}

fn drawn_texels(data: &SceneData<'_>) -> usize {
    data.drawn_singly().map_or(0, area)
}

fn mean_texels(data: &SceneData<'_>) -> usize {
    data.of_mean(|mean| area(mean.size))
}

/// Size of the image with one sample of a texel.
fn drawn_singly(data: &SceneData<'_>) -> [u32; 2] {
    data.drawn_singly().unwrap_or_default()
}

/// Size of the largest image that is drawn.
pub(in crate::gpu) fn drawn_largest(data: &SceneData<'_>) -> [u32; 2] {
    data.drawn().unwrap_or_default()
}
