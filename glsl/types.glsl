// Structures shared with Rust. Their twins in src/gpu/layout/ document the members.

struct Material {
    float absorptivity;
    float emissivity;
    float back_absorptivity;
    float back_emissivity;
    float heating_function;
    float heating_t_max;
    float cooling_function;
    float cooling_t_max;
    float share;
    float emission;
    float own_emission;
    float exchange;
    float structure_share;
    float parts;
};

struct Step {
    vec4 nadir;
    vec4 sunward;
    vec4 across;
    float planet_ir;
    float albedo_flux;
    float background_temperature_4;
    float length;
    float albedo_resolution;
    float count;
    float sun_sine;
    float sun_cosine;
};

struct View {
    vec4 camera_from_body_x;
    vec4 camera_from_body_y;
    vec4 camera_from_body_z;
    vec2 clip_scale;
    vec2 clip_offset;
    vec2 size;
    float near;
    float margin;
};

struct Shutter {
    vec4 middle_x;
    vec4 middle_y;
    vec4 middle_z;
    vec4 last_x;
    vec4 last_y;
    vec4 last_z;
    vec4 field;
    vec4 first_numbers;
    vec4 second_numbers;
    vec4 third_numbers;
    float row_scale;
    float row_offset;
};

struct Sampling {
    uint width;
    uint height;
    uint source_width;
    uint source_height;
    uint columns;
    uint rows;
};

struct Distant {
    vec2 corner;
    vec2 focal;
    vec2 centre;
    float scale;
    float lookups;
    uint width;
    uint height;
    uint across;
    uint down;
};

struct Surroundings {
    vec4 nadir;
    vec4 sun;
    float planet_cosine;
    float sun_cosine;
    float planet_radiance;
    float space_radiance;
    float sun_radiance;
    float sun_irradiance;
};

struct Reflector {
    float emissivity;
    float specular;
    float roughness;
    float lobe;
    float table;
    float of_planet;
    float of_space;
    float of_sun;
};

struct Tracing {
    uint boxes;
    uint word;
    float start;
    uint width;
    uint texels;
    uint surface_width;
    uint bounces;
    uint vertices;
    uint roulette;
    float least;
};

struct PlanetView {
    vec4 x;
    vec4 y;
    vec4 z;
};

struct DrawCommand {
    uint index_count;
    uint instance_count;
    uint first_index;
    int vertex_offset;
    uint first_instance;
};

struct ShadowBox {
    vec3 low;
    uint skip;
    vec3 high;
    uint triangles;
};

struct ShadowTriangle {
    vec4 corner;
    vec4 first;
    vec4 second;
};

struct Band {
    float edge_high;
    float edge_low;
};

struct ExchangePatch {
    vec3 normal;
    float emissivity;
    float absorptivity;
    float per_area;
    uint first_node;
    uint end_node;
    uint joint;
    float specular;
    uint back;
    float cooling;
    float radius;
};

struct ExchangeRow {
    uint first_entry;
    uint end_entry;
    uint first_reflected;
    uint end_reflected;
    float itself;
    float itself_reflected;
    float exposed;
};

struct ExchangePass {
    uint first;
    uint end;
    uint rays;
    float held;
    float lead;
    uint patches;
    float share;
    uint slot;
};

struct HeatPass {
    uint first;
    float background_temperature_4;
};

struct Steps {
    uint count;
    uint groups;
};
