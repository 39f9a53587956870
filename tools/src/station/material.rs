//! The thermal materials of the station, with base colours for ordinary glTF viewers.

/// A glTF material. The scene file gives thermal values by this name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Material {
    /// Array blankets: cells towards the normal, polyimide on the back.
    SolarCells,
    /// Lattice masts that carry the blankets.
    ArrayMast,
    /// Painted debris shields of the pressurised modules.
    WhitePaint,
    /// Radiator panels, both faces painted.
    RadiatorPanel,
    /// Multi-layer insulation with an aluminised polyimide cover: end cones, equipment.
    MliBlanket,
    /// Members of the truss.
    AluminiumTruss,
    /// Mechanisms: joints, ports, canisters, beams.
    AnodizedAluminium,
    /// Docking targets, heat shield, deep openings.
    BlackPaint,
    /// Panes of the cupola.
    WindowGlass,
    /// Silvered FEP film on the capsule's trunk.
    SilveredTeflon,
}

/// The appearance in an ordinary viewer. It has no thermal meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Linear RGB base colour.
    pub base_colour: [f64; 3],
    /// glTF metallic factor.
    pub metallic: f64,
    /// glTF roughness factor.
    pub roughness: f64,
}

impl Material {
    /// Every material, in the order of the file.
    pub const ALL: [Self; 10] = [
        Self::SolarCells,
        Self::ArrayMast,
        Self::WhitePaint,
        Self::RadiatorPanel,
        Self::MliBlanket,
        Self::AluminiumTruss,
        Self::AnodizedAluminium,
        Self::BlackPaint,
        Self::WindowGlass,
        Self::SilveredTeflon,
    ];

    /// The glTF name.
    pub fn name(self) -> &'static str {
        match self {
            Self::SolarCells => "solar_cells",
            Self::ArrayMast => "array_mast",
            Self::WhitePaint => "white_paint",
            Self::RadiatorPanel => "radiator_panel",
            Self::MliBlanket => "mli_blanket",
            Self::AluminiumTruss => "aluminium_truss",
            Self::AnodizedAluminium => "anodized_aluminium",
            Self::BlackPaint => "black_paint",
            Self::WindowGlass => "window_glass",
            Self::SilveredTeflon => "silvered_teflon",
        }
    }

    /// Whether it is a single sheet of triangles, visible and radiating on both sides.
    pub fn is_sheet(self) -> bool {
        matches!(self, Self::SolarCells | Self::RadiatorPanel)
    }

    pub fn appearance(self) -> Appearance {
        let (base_colour, metallic, roughness) = match self {
            Self::SolarCells => ([0.03, 0.05, 0.16], 0.2, 0.3),
            Self::ArrayMast => ([0.35, 0.33, 0.28], 0.3, 0.6),
            Self::WhitePaint => ([0.82, 0.81, 0.77], 0.0, 0.7),
            Self::RadiatorPanel => ([0.88, 0.88, 0.88], 0.0, 0.5),
            Self::MliBlanket => ([0.72, 0.48, 0.14], 0.6, 0.4),
            Self::AluminiumTruss => ([0.62, 0.62, 0.60], 0.8, 0.5),
            Self::AnodizedAluminium => ([0.45, 0.45, 0.42], 0.6, 0.5),
            Self::BlackPaint => ([0.02, 0.02, 0.02], 0.0, 0.8),
            Self::WindowGlass => ([0.10, 0.14, 0.16], 0.1, 0.1),
            Self::SilveredTeflon => ([0.75, 0.76, 0.78], 0.9, 0.2),
        };
        Appearance { base_colour, metallic, roughness }
    }
}
