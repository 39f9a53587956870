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

// What one tick commands, the same for every node.
struct Tick {
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
    // Length of the tick in steps; below 1 only for the last, partial step of a still image.
    float step;
    // Intervals of the albedo table each way.
    float albedo_resolution;
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

// A node of a network.
struct NetworkNode {
    // 1 / C [K/J]; 0 of a node that stores no heat.
    float inverse_capacitance;
    // C [J/K].
    float capacitance;
    // Stefan-Boltzmann constant x emissivity x area to space [W/K4].
    float emission;
    // Sum of GL [W/K].
    float conductance_sum;
    // Stefan-Boltzmann constant x (sum of GR + emissivity x area) [W/K4].
    float emission_sum;
    // Its links: the first, and the one after the last.
    uint links_begin;
    uint links_end;
};

// What a node exchanges with one neighbour.
struct NetworkLink {
    uint neighbour;
    // GL [W/K].
    float conductance;
    // Stefan-Boltzmann constant x GR [W/K4].
    float exchange;
};

// One stage of RKL2: change = mu x last + nu x last but one + mu_step x rate + gamma_step x rate at the start.
struct NetworkStage {
    float mu;
    float nu;
    // [s]
    float mu_step;
    // [s]
    float gamma_step;
    // Time of the stage [s] since the sub-step's start.
    float time;
};

// What one dispatch of the fused kernels does.
struct NetworkAttempt {
    uint nodes;
    // Sub-steps, or iterations of a balance.
    uint count;
    uint stages;
    uint sensors;
    // Arithmetic nodes without arithmetic neighbours; their list follows the sensors.
    uint lone;
    // Start [s] since the heat was set.
    float time;
    // Length of a sub-step [s].
    float step;
    float space_temperature;
    // Turns of loops of a sub-step, and of one iteration of Newton's method. Some drivers end a shader's loops after
    // 65,535 turns in all.
    uint loops_sub_step;
    uint loops_iteration;
    // Nodes of the system that is solved by elimination, and where its parts begin in the schedule and in the matrix.
    uint unknowns;
    uint levels;
    uint nodes_at;
    uint entries_at;
    uint levels_at;
    uint targets_at;
    uint terms_at;
    uint pivots_at;
    uint uppers_at;
    uint fill_begin;
    uint fill_end;
    uint right_at;
};
