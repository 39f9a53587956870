//! Where the camera is for an image: on a shell or a cone round the craft, in an approach corridor, or on the path of the scene.

use glam::{DQuat, DVec2, DVec3};

use super::distribution::{Distribution, direction};
use super::random::RandomSource;
use super::reader::SpecTable;
use crate::environment::pose_path::look;
use crate::scene::{Camera, CameraFrame, SceneError};
use crate::simulation::pose::{CameraError, Pose};

/// Keys of `[[camera]]`.
pub(crate) const CAMERA: &[&str] =
    &["kind", "weight", "frame", "look_at", "distance", "axis", "half_angle_deg", "across", "roll_deg", "pointing_px"];

/// Largest distance of a camera [m].
const FARTHEST: f64 = 1e7;

#[derive(Debug, Clone, PartialEq)]
enum CameraPlace {
    /// Within an angle [deg] of an axis, uniform on the sphere.
    Cone { axis: DVec3, half_angle: f64 },
    /// Beside an axis by a distance [m] in both directions across it.
    Corridor { axis: DVec3, across: Distribution },
    /// On the path of the scene's camera.
    Path,
}

/// A way to place the camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraRule {
    weight: f64,
    frame: CameraFrame,
    place: CameraPlace,
    /// Distance from `look_at`, or along the axis of a corridor [m].
    distance: Distribution,
    look_at: DVec3,
    /// Rotation about the line of sight [deg].
    roll: Distribution,
    /// Where `look_at` appears, right and below the principal point [px].
    pointing: Distribution,
}

impl CameraRule {
    /// Reads `[camera]`, or each `[[camera]]`.
    pub(super) fn read(root: &SpecTable) -> Result<Vec<Self>, SceneError> {
        let tables = match root.is_table("camera") {
            true => root.table("camera", CAMERA)?.into_iter().collect(),
            false => root.tables("camera", CAMERA)?,
        };
        if tables.is_empty() {
            return Err(root.error("camera", "is missing: a section [camera] says where the camera is"));
        }
        tables.iter().map(rule).collect()
    }

    /// Names of the numbers of an image.
    pub(crate) fn names(rules: &[Self]) -> Vec<String> {
        let mut names = if rules.len() > 1 { vec!["camera.choice".to_owned()] } else { Vec::new() };
        let mut add = |name: String| {
            if !names.contains(&name) {
                names.push(name);
            }
        };
        for rule in rules {
            rule.distance.names("camera.distance").into_iter().for_each(&mut add);
            match &rule.place {
                CameraPlace::Cone { .. } => {
                    ["around", "height"].map(|part| format!("camera.{part}")).into_iter().for_each(&mut add);
                }
                CameraPlace::Corridor { across, .. } => ["camera.across.x", "camera.across.y"]
                    .into_iter()
                    .flat_map(|name| across.names(name))
                    .for_each(&mut add),
                CameraPlace::Path => {}
            }
            rule.roll.names("camera.roll").into_iter().for_each(&mut add);
            for name in ["camera.pointing.x", "camera.pointing.y"] {
                rule.pointing.names(name).into_iter().for_each(&mut add);
            }
        }
        names
    }

    /// The rule of an image.
    pub(crate) fn choose<'a>(rules: &'a [Self], source: &RandomSource) -> &'a Self {
        let all: f64 = rules.iter().map(|rule| rule.weight).sum();
        let mut left = if rules.len() > 1 { source.uniform("camera.choice") * all } else { 0.0 };
        let met = rules.iter().find(|rule| {
            left -= rule.weight;
            left < 0.0
        });
        met.unwrap_or(&rules[rules.len() - 1])
    }

    /// Whether it takes the path of the scene's camera.
    pub(crate) fn is_on_path(&self) -> bool {
        self.place == CameraPlace::Path
    }

    /// The pose of an image at a time [s].
    ///
    /// # Errors
    /// A path that does not cover the time, or a view without a direction.
    pub(crate) fn draw(&self, source: &RandomSource, camera: &Camera, time: f64) -> Result<Pose, CameraError> {
        let roll = DQuat::from_rotation_z(self.roll.number("camera.roll", source).to_radians());
        let pointing = ["camera.pointing.x", "camera.pointing.y"].map(|name| self.pointing.number(name, source));
        let centre = DVec2::from(camera.lens.centre);
        let ray = camera.lens.unproject(centre + DVec2::from(pointing)).unwrap_or_default().extend(1.0).normalize();
        // The ray of the place in the image takes the line of sight.
        let turned = roll * DQuat::from_rotation_arc(ray, DVec3::Z);
        let distance = self.distance.number("camera.distance", source);
        let from_target = match &self.place {
            CameraPlace::Path => {
                let there =
                    camera.at(time, None).map_err(|_| CameraError::Pose("its path has no pose at this time"))?;
                return Pose::new(there.frame, there.position, (there.frame_from_camera * turned).normalize());
            }
            CameraPlace::Cone { axis, half_angle } => {
                let one = DVec3::from(direction("camera", source, *half_angle));
                DQuat::from_rotation_arc(DVec3::Z, *axis) * one * distance
            }
            CameraPlace::Corridor { axis, across } => {
                let [x, y] = ["camera.across.x", "camera.across.y"].map(|name| across.number(name, source));
                DQuat::from_rotation_arc(DVec3::Z, *axis) * DVec3::new(x, y, distance)
            }
        };
        let forward = from_target.try_normalize().map(|out| -out);
        let forward = forward.ok_or(CameraError::Pose("it stands on the point that it looks at"))?;
        let up = if forward.z.abs() < 0.9 { DVec3::NEG_Z } else { DVec3::X };
        Pose::new(self.frame, self.look_at + from_target, (look(forward, up) * turned).normalize())
    }
}

#[derive(Clone, Copy, PartialEq)]
enum CameraRuleKind {
    Shell,
    Cone,
    Corridor,
    Path,
}

fn rule(table: &SpecTable) -> Result<CameraRule, SceneError> {
    let kinds = [
        ("shell", CameraRuleKind::Shell),
        ("cone", CameraRuleKind::Cone),
        ("corridor", CameraRuleKind::Corridor),
        ("path", CameraRuleKind::Path),
    ];
    let kind = table.required("kind", table.choice("kind", &kinds)?, "shell, cone, corridor or path")?;
    for (key, owners) in [
        ("distance", &[CameraRuleKind::Shell, CameraRuleKind::Cone, CameraRuleKind::Corridor][..]),
        ("look_at", &[CameraRuleKind::Shell, CameraRuleKind::Cone, CameraRuleKind::Corridor]),
        ("frame", &[CameraRuleKind::Shell, CameraRuleKind::Cone, CameraRuleKind::Corridor]),
        ("axis", &[CameraRuleKind::Cone, CameraRuleKind::Corridor]),
        ("half_angle_deg", &[CameraRuleKind::Cone]),
        ("across", &[CameraRuleKind::Corridor]),
    ] {
        if table.has(key) && !owners.contains(&kind) {
            let word = kinds.iter().find(|(_, one)| *one == kind).map_or("", |(word, _)| word);
            return Err(table.error(key, &format!("has no meaning for kind = \"{word}\"")));
        }
    }
    let frames = [("body", CameraFrame::Body), ("orbit", CameraFrame::Orbit), ("inertial", CameraFrame::Inertial)];
    let axis = || {
        let axis = table.required("axis", table.numbers::<3>("axis")?, "[x, y, z], from the craft to the camera")?;
        DVec3::from(axis).try_normalize().ok_or_else(|| table.error("axis", "must not be zero"))
    };
    let place = match kind {
        CameraRuleKind::Shell => CameraPlace::Cone { axis: DVec3::Z, half_angle: 180.0 },
        CameraRuleKind::Cone => {
            let half_angle = table.number("half_angle_deg", 0.0..=180.0)?;
            let half_angle = table.required("half_angle_deg", half_angle, "the greatest angle to the axis [deg]")?;
            CameraPlace::Cone { axis: axis()?, half_angle }
        }
        CameraRuleKind::Corridor => {
            let across = table.drawn_number("across", -FARTHEST..=FARTHEST, "m")?;
            CameraPlace::Corridor {
                axis: axis()?,
                across: table.required("across", across, "the distance from the axis [m]")?,
            }
        }
        CameraRuleKind::Path => CameraPlace::Path,
    };
    let none = || Distribution::Constant(toml::Value::Float(0.0));
    let distance = table.drawn_number("distance", 1e-3..=FARTHEST, "m")?;
    let distance = match kind {
        CameraRuleKind::Path => none(),
        _ => table.required("distance", distance, "the distance to the craft [m]")?,
    };
    Ok(CameraRule {
        weight: table.number("weight", 1e-9..=1e9)?.unwrap_or(1.0),
        frame: table.choice("frame", &frames)?.unwrap_or(CameraFrame::Body),
        place,
        distance,
        look_at: DVec3::from(table.numbers::<3>("look_at")?.unwrap_or_default()),
        roll: table.drawn_number("roll_deg", -3600.0..=3600.0, "deg")?.unwrap_or_else(none),
        pointing: table.drawn_number("pointing_px", -1e5..=1e5, "px")?.unwrap_or_else(none),
    })
}
