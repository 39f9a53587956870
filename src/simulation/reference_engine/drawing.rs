//! Images of the f64 reference: a rasteriser in f64, and the sensor's twin.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::environment::shadow::Jointed;
use crate::model::nodes::GROUP;
use crate::raster::changes::PixelChanges;
use crate::raster::distant::{Crop, gather};
use crate::raster::{self, RasterSurface, SurfaceSurroundings, rasterise, rasterise_changed, rasterise_finely};
use crate::scene::Camera;
use crate::simulation::device_data::is_own;
use crate::simulation::distant::DistantParts;
use crate::simulation::engine::{ImageMoments, InstantPoses, Order};
use crate::simulation::image::Image;
use crate::simulation::pose::draws_alike;
use crate::simulation::prepare::Prepared;
use crate::simulation::surroundings::Finishes;
use crate::simulation::viewpoint::{raster_view, sensor_view};
use crate::thermal::radiance::{RadianceTable, band_radiance};
use crate::thermal::sensor::spread::FINENESS;
use crate::thermal::sensor::twin::SensorTwin;
use crate::thermal::surroundings::Surroundings;

/// What is drawn.
#[derive(Default)]
struct Shown {
    pixels: Vec<raster::Pixel>,
    /// Radiance of the texels in the pixels, for a point spread.
    texels: Vec<f64>,
    changes: Option<PixelChanges>,
}

impl Shown {
    /// An image of this size without light.
    fn emptied(&self) -> Self {
        Self { pixels: vec![raster::EMPTY; self.pixels.len()], texels: vec![0.0; self.texels.len()], changes: None }
    }
}

/// The surface of a scene, and the camera that sees it.
pub(super) struct Drawing {
    /// The surface that is drawn, in the file's pose.
    surface: Jointed,
    /// Normals of the surface, in the file's pose. Empty where no pixel needs them.
    normals: Vec<DVec3>,
    finishes: Finishes,
    /// The boxes of a craft that may be far away.
    distance: Option<DistantParts>,
    parts: Vec<u32>,
    materials: Vec<u32>,
    emissivities: Vec<[f64; 2]>,
    camera: Option<Camera>,
    table: RadianceTable,
    pub(super) sensor: Option<SensorTwin>,
}

impl Drawing {
    /// The surface of a scene. Images are drawn where `camera` is given.
    pub(super) fn new(prepared: &Prepared, camera: Option<&Camera>) -> Self {
        let nodes = &prepared.nodes;
        let slots = 0..nodes.vertex_of_node.len();
        let of_group = |group: &[u32]| slots.clone().map(|slot| group[slot / GROUP]).collect();
        let finishes = Finishes::new(prepared);
        let has_normals = !finishes.reflectors.is_empty();
        let shown = if finishes.crinkled.is_empty() { &nodes.normals } else { &finishes.crinkled };
        let table = RadianceTable::new(prepared.scene.passband());
        let sensed = prepared.scene.sensor.as_ref().zip(camera).filter(|_| is_own(prepared, camera));
        Self {
            surface: Jointed {
                positions: nodes.positions.iter().map(|position| position.as_dvec3()).collect(),
                triangles: prepared.triangles.clone(),
                joints: if prepared.joints() > 1 { prepared.joints_of(slots.clone()) } else { Vec::new() },
            },
            normals: shown.iter().filter(|_| has_normals).map(|normal| normal.as_dvec3()).collect(),
            finishes,
            distance: camera.and_then(|camera| DistantParts::new(prepared, camera)),
            parts: of_group(&nodes.group_part),
            materials: of_group(&nodes.group_material),
            emissivities: prepared
                .materials
                .iter()
                .map(|material| [material.front.emissivity, material.back().emissivity])
                .collect(),
            camera: camera.cloned(),
            sensor: sensed.map(|(sensor, camera)| SensorTwin::new(sensor, &table, sensor_view(camera))),
            table,
        }
    }

    /// Takes another camera whose images need no other resources. Returns whether it is one.
    pub(super) fn take_camera(&mut self, camera: &Camera) -> bool {
        let fits = self.camera.as_ref().is_some_and(|own| draws_alike(own, camera, self.sensor.is_none()));
        if fits {
            self.camera = Some(camera.clone());
        }
        fits
    }

    /// The image that an order asks for, of nodes at temperatures [K]. `None` without a pose or a camera.
    pub(super) fn image(&mut self, order: &Order<'_>, temperatures: &[f64]) -> Option<Image> {
        order.pose.as_ref()?;
        let camera = self.camera.clone()?;
        let Shown { pixels: drawn, texels, changes } = match order.moments {
            Some(moments) if camera.exposure.is_mean() => self.exposed(&camera, moments, order, temperatures),
            _ => self.draw_instant(&camera, order, temperatures)?,
        };
        let of_surface = |value: fn(&raster::Pixel) -> f64| {
            drawn.iter().map(|pixel| if pixel.part == 0 { 0.0 } else { value(pixel) as f32 }).collect()
        };
        let (has_coverage, is_apart) = (camera.samples > 1, self.finishes.is_apart());
        let readings = self.sensor.as_mut().map(|sensor| {
            let radiance: Vec<f64> = drawn.iter().map(|pixel| pixel.radiance).collect();
            sensor.expose(&radiance, &texels, order.time)
        });
        let image = Image {
            radiance: drawn.iter().map(|pixel| pixel.radiance as f32).collect(),
            temperature: of_surface(|pixel| pixel.temperature),
            depth: of_surface(|pixel| pixel.depth),
            part: drawn.iter().map(|pixel| pixel.part).collect(),
            material: drawn.iter().map(|pixel| pixel.material).collect(),
            coverage: drawn.iter().filter(|_| has_coverage).map(|pixel| pixel.coverage as f32).collect(),
            reflected: drawn.iter().filter(|_| is_apart).map(|pixel| pixel.reflected as f32).collect(),
            changes: changes.map(Arc::new),
            ..order.image_of(&camera)?
        };
        Some(image.with_readings(readings.as_deref()))
    }

    /// The mean over the sub-frames of an exposure. A pixel shows the surface of the first of them that has one.
    fn exposed(
        &mut self,
        camera: &Camera,
        ImageMoments(moment): ImageMoments<'_>,
        order: &Order<'_>,
        temperatures: &[f64],
    ) -> Shown {
        let share = 1.0 / f64::from(camera.exposure.sub_frames);
        let mut mean: Option<Shown> = None;
        for offset in camera.exposure.offsets() {
            let (instant, later) = (moment(offset), |later: f64| moment(offset + later));
            let order = order.sub_frame(offset, &instant, ImageMoments(&later));
            let Some(drawn) = self.draw_instant(camera, &order, temperatures) else { continue };
            let mut sum = mean.unwrap_or_else(|| drawn.emptied());
            for (sum, one) in sum.pixels.iter_mut().zip(drawn.pixels) {
                let shown = if sum.part == 0 { one } else { *sum };
                *sum = raster::Pixel {
                    radiance: sum.radiance + share * one.radiance,
                    reflected: sum.reflected + share * one.reflected,
                    coverage: sum.coverage + share * one.coverage,
                    ..shown
                };
            }
            sum.texels.iter_mut().zip(drawn.texels).for_each(|(sum, one)| *sum += share * one);
            mean = Some(sum);
        }
        mean.unwrap_or_default()
    }

    /// Draws one instant, or the rows that follow it with a rolling shutter. `None` without a pose.
    fn draw_instant(&mut self, camera: &Camera, order: &Order<'_>, temperatures: &[f64]) -> Option<Shown> {
        if let Some(around) = &order.surroundings {
            self.finishes.look_at(around);
        }
        if let Some(traced) = &mut self.finishes.traced {
            traced.follow(order.joints);
        }
        let pose = order.pose.as_ref()?;
        Some(match order.moments {
            Some(rows) if camera.line_time > 0.0 => self.draw_rows(camera, rows, order, temperatures),
            _ => self.draw_from(camera, pose, order, temperatures),
        })
    }

    /// Draws from one pose. A craft that is far away is drawn larger and gathered into the pixels.
    fn draw_from(&self, camera: &Camera, pose: &DAffine3, order: &Order<'_>, temperatures: &[f64]) -> Shown {
        let view = raster_view(camera, pose);
        let around = (order.surroundings.as_ref(), order.time);
        let is_fine = self.is_fine();
        match self.distance.as_ref().and_then(|distance| distance.crop(camera, pose, order.joints)) {
            None => {
                let past = order.past.filter(|_| camera.lens.is_pinhole() && !is_fine && order.moments.is_none());
                let changes = past.and_then(|past| past.changes(&view, order.joints, temperatures));
                self.draw(temperatures, order.joints, &view, around, (is_fine, changes))
            }
            Some(crop) => {
                let of_crop = self.draw(temperatures, order.joints, &crop.view(&view), around, (false, None)).pixels;
                let gathered = |view: &raster::RasterView, crop: &Crop| {
                    let mut image = self.draw_sky(view, order.surroundings.as_ref());
                    gather(&mut image, view.width as usize, crop, &of_crop);
                    image
                };
                let finer = is_fine.then(|| gathered(&view.finer(FINENESS), &crop.finer(FINENESS)));
                let texels = finer.iter().flatten().map(|texel| texel.radiance).collect();
                Shown { pixels: gathered(&view, &crop), texels, changes: None }
            }
        }
    }

    /// Whether the sensor reads the texels in the pixels.
    fn is_fine(&self) -> bool {
        self.sensor.as_ref().is_some_and(SensorTwin::spreads)
    }

    /// Draws each row from its own pose.
    fn draw_rows(
        &self,
        camera: &Camera,
        ImageMoments(moment): ImageMoments<'_>,
        order: &Order<'_>,
        temperatures: &[f64],
    ) -> Shown {
        let row = |row: u32| {
            let InstantPoses { pose, joints, surroundings, .. } = moment(f64::from(row) * camera.line_time);
            let around = (surroundings.as_ref(), order.time);
            let mut view = raster_view(camera, &pose);
            view.lens.centre[1] -= f64::from(row);
            self.draw(
                temperatures,
                &joints,
                &raster::RasterView { height: 1, first_row: row, ..view },
                around,
                (self.is_fine(), None),
            )
        };
        let rows: Vec<Shown> = (0..camera.height).map(row).collect();
        let texels = rows.iter().flat_map(|row| &row.texels).copied().collect();
        Shown { pixels: rows.into_iter().flat_map(|row| row.pixels).collect(), texels, changes: None }
    }

    /// Normals of the surface as the joints turn it.
    fn turned(&self, joints: &[DAffine3]) -> Cow<'_, [DVec3]> {
        if self.surface.joints.is_empty() {
            return Cow::Borrowed(&self.normals);
        }
        let turn = |(normal, joint): (&DVec3, &u32)| joints[*joint as usize].matrix3 * *normal;
        Cow::Owned(self.normals.iter().zip(&self.surface.joints).map(turn).collect())
    }

    /// Draws the surface as the joints place it, in the surroundings that were looked at last.
    fn draw(
        &self,
        temperatures: &[f64],
        joints: &[DAffine3],
        view: &raster::RasterView,
        (surroundings, time): (Option<&Surroundings>, f64),
        (is_fine, changes): (bool, Option<PixelChanges>),
    ) -> Shown {
        let placed;
        let positions = if self.surface.joints.is_empty() {
            &self.surface.positions
        } else {
            placed = self.surface.placed(joints);
            &placed
        };
        let normals = self.turned(joints);
        let seen = surroundings.is_some() || !self.finishes.reflectors.is_empty();
        let around = seen.then(|| SurfaceSurroundings {
            surroundings,
            background: self.finishes.has_background(),
            normals: &normals,
            reflects: self.finishes.reflects(),
            reflectors: &self.finishes.reflectors,
            looks: self.finishes.looks(),
            traced: self.finishes.traced.as_ref().map(|traced| traced.seen(time)),
        });
        let surface = RasterSurface {
            around,
            positions,
            triangles: &self.surface.triangles,
            temperatures,
            vertex_part: &self.parts,
            vertex_material: &self.materials,
            emissivities: &self.emissivities,
        };
        let radiance = |t| band_radiance(&self.table, t);
        if is_fine {
            let (pixels, texels) = rasterise_finely(&surface, view, FINENESS, radiance);
            return Shown { pixels, texels, changes };
        }
        let pixels = rasterise_changed(&surface, view, changes.as_ref(), radiance);
        Shown { pixels, texels: Vec::new(), changes }
    }

    /// Draws what stands behind the surface.
    fn draw_sky(&self, view: &raster::RasterView, surroundings: Option<&Surroundings>) -> Vec<raster::Pixel> {
        let around = surroundings.map(|surroundings| SurfaceSurroundings {
            surroundings: Some(surroundings),
            background: self.finishes.has_background(),
            normals: &[],
            reflects: false,
            reflectors: &[],
            looks: self.finishes.looks(),
            traced: None,
        });
        let nothing = RasterSurface {
            around,
            positions: &[],
            triangles: &[],
            temperatures: &[],
            vertex_part: &[],
            vertex_material: &[],
            emissivities: &[],
        };
        rasterise(&nothing, view, |_| 0.0)
    }
}
