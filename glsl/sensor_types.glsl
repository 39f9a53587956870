// The structure of the sensor that is shared with Rust. Its twin in src/gpu/layout/ documents the members.

struct Sensor {
    vec4 optics;
    uint width;
    uint height;
    uint groups;
    uint terms;
    uint radius;
    uint halo_weights;
    uint cell;
    uint cells_across;
    uint cells_down;
    uint reach;
    uint seed;
    uint time_low;
    uint time_high;
    uint shutter;
    float halo_share;
    float decay;
    float noise;
    float offset_pattern;
    float gain_pattern;
    float drift;
    float scale;
    float offset;
    float most;
    float bad;
    float counts;
    float most_radiance;
    vec2 focal;
    vec2 centre;
    uint serial;
    float behind;
};
