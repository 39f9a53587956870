// Structures shared with Rust: each has its twin of the same name in src/gpu/layout.rs, compared by tests/it/layout.rs.

// Values of one material, read once by each group of four nodes.
struct Material {
    float absorptivity;
    float emissivity;
    float back_absorptivity;
    float back_emissivity;
    // Transition: power of the remaining share (1 linear, 2 quadratic) or, for shaped ones, number of the function, and
    // time to the target [steps].
    float heating_function;
    float heating_t_max;
    float cooling_function;
    float cooling_t_max;
};

// What one step commands, the same for every node.
struct Step {
    // xyz: unit vector to the planet's centre, body frame; w: sine of the planet's angular radius.
    vec4 nadir;
    // xyz: unit vector at right angles to nadir, towards the Sun's side; w: cosine of the planet's angular radius.
    vec4 sunward;
    // xyz: nadir x sunward.
    vec4 across;
    // Infrared exitance of the planet [W/m2].
    float planet_ir;
    // Albedo x solar constant [W/m2].
    float albedo_flux;
    // Fourth power of the radiative temperature of space [K4].
    float background_temperature_4;
    // Length in steps of the scene; below 1 only for the last, partial step of a still image.
    float length;
    // Intervals of the albedo table each way.
    float albedo_resolution;
    // Steps of a fused dispatch, said by the first of them.
    float count;
};

// Where the image is taken from, and with what.
struct View {
    // Rows of camera_from_body: xyz rotation, w translation [m].
    vec4 camera_from_body_x;
    vec4 camera_from_body_y;
    vec4 camera_from_body_z;
    // clip.x = scale.x * x + offset.x * z, clip.y = scale.y * y + offset.y * z (OpenCV axes, Y down as in Vulkan).
    vec2 clip_scale;
    vec2 clip_offset;
    // Width and height in pixels.
    vec2 size;
    // Distance of the near plane [m]; depth is reversed and its far plane at infinity.
    float near;
    // Motion in the image that culling allows for [px].
    float margin;
};

// A draw of indexed triangles as the device reads it (VkDrawIndexedIndirectCommand).
struct DrawCommand {
    uint index_count;
    uint instance_count;
    uint first_index;
    int vertex_offset;
    uint first_instance;
};

// The Sun's parallel view of the craft.
struct SunView {
    // Column, row (texels) and depth (0 to 1) of a point: factors of its coordinates, and what is added.
    vec4 texel_from_body_x;
    vec4 texel_from_body_y;
    vec4 texel_from_body_z;
    // xyz: unit vector to the Sun, body frame; w: how far a node is lifted off its surface [m].
    vec4 sun;
    // xyz: unit vector along rows; w: depth of one texel's side.
    vec4 right;
    // xyz: unit vector along columns; w: texels each way.
    vec4 down;
};

// A box of the tree that rays are tried against: the boxes in it follow.
struct ShadowBox {
    vec3 low;
    // The box to go on with where this one is missed.
    uint skip;
    vec3 high;
    // First triangle x 8 + their number; no triangles where there are boxes in it.
    uint triangles;
};

// A triangle that casts a shadow: a corner and the edges from there [m].
struct ShadowTriangle {
    vec4 corner;
    vec4 first;
    vec4 second;
};

// A point of the Sun's disc.
struct SunRay {
    // xyz: unit vector to the middle of the Sun; w: how far a ray starts off its surface [m].
    vec4 sun;
    // xyz: unit vector to the point; w: its share of the disc.
    vec4 direction;
    // Boxes of the tree.
    uint boxes;
};

// Head of the table of a band.
struct Band {
    // c2 / longest wavelength [K], and what its rounding left.
    float edge_high;
    float edge_low;
};

// How many steps of a response to take at once.
struct Steps {
    uint count;
    // Groups of four nodes of one step.
    uint groups;
};
