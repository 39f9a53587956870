//! The messages of Basilisk's `vizInterface`, written field by field.

use glam::{DMat3, DQuat, DVec3};

/// A message under way.
#[derive(Default, Clone)]
pub struct Fields(pub Vec<u8>);

impl Fields {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn bytes(mut self, field: u64, content: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(content.len() as u64);
        self.0.extend_from_slice(content);
        self
    }

    /// An integer. Zero is absent.
    pub fn int(mut self, field: u64, value: i64) -> Self {
        if value != 0 {
            self.varint(field << 3);
            self.varint(value as u64);
        }
        self
    }

    pub fn double(mut self, field: u64, value: f64) -> Self {
        if value != 0.0 {
            self.varint(field << 3 | 1);
            self.0.extend(value.to_le_bytes());
        }
        self
    }

    pub fn text(self, field: u64, text: &str) -> Self {
        if text.is_empty() { self } else { self.bytes(field, text.as_bytes()) }
    }

    pub fn message(self, field: u64, message: &Fields) -> Self {
        self.bytes(field, &message.0)
    }

    pub fn vector(self, field: u64, vector: DVec3) -> Self {
        self.doubles(field, &vector.to_array())
    }

    pub fn doubles(self, field: u64, numbers: &[f64]) -> Self {
        let packed: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        self.bytes(field, &packed)
    }

    pub fn ints(self, field: u64, numbers: &[u64]) -> Self {
        let mut packed = Self::default();
        numbers.iter().for_each(|number| packed.varint(*number));
        self.bytes(field, &packed.0)
    }
}

/// Modified Rodrigues parameters of the rotation from parent to child axes.
pub fn parameters(parent_from_child: DQuat) -> DVec3 {
    let q = if parent_from_child.w < 0.0 { -parent_from_child } else { parent_from_child };
    q.xyz() / (1.0 + q.w)
}

/// What the wire carries for a camera whose axes (OpenCV) are turned so in the body of its craft.
pub fn direction(camera_from_body: DMat3) -> DVec3 {
    let wire_from_camera =
        DMat3::from_cols(DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 0.0, -1.0), DVec3::new(-1.0, 0.0, 0.0));
    parameters(DQuat::from_mat3(&(wire_from_camera * camera_from_body).transpose()))
}

pub fn body(name: &str, position: DVec3, mu: f64, radius_km: f64) -> Fields {
    let fields = Fields::default().text(1, name).vector(2, position).vector(3, DVec3::ZERO);
    fields.doubles(4, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).double(5, mu).double(6, radius_km).double(7, 1.0)
}

pub fn craft(name: &str, position: DVec3, velocity: DVec3, inertial_from_body: DQuat) -> Fields {
    let fields = Fields::default().text(1, name).vector(2, position).vector(3, velocity);
    fields.vector(4, parameters(inertial_from_body)).text(13, "a model key")
}

/// A camera with the fields that stock scripts send.
pub struct Camera {
    pub id: i64,
    pub size: [u64; 2],
    pub fov_deg: f64,
    pub position: DVec3,
    pub camera_from_body: DMat3,
    pub depth: Option<f64>,
}

impl Camera {
    pub fn fields(&self) -> Fields {
        let fields = Fields::default().int(1, self.id).text(2, "chaser").double(3, self.fov_deg).ints(4, &self.size);
        let fields = fields.int(5, 1).vector(7, self.position).vector(8, direction(self.camera_from_body));
        let fields = fields.int(9, 60_000_000_000).text(10, "black").double(12, 0.5);
        match self.depth {
            None => fields,
            Some(far) => fields.int(16, 1).doubles(17, &[0.1, far]),
        }
    }
}

pub fn message(frame: i64, time: f64, bodies: &[Fields], craft: &[Fields], cameras: &[Fields]) -> Fields {
    let mut all = Fields::default().message(1, &Fields::default().int(1, frame).double(2, 1e9 * time));
    for (field, list) in [(2, bodies), (3, craft), (4, cameras)] {
        all = list.iter().fold(all, |all, one| all.message(field, one));
    }
    all.message(10, &Fields::default())
}
