// A response function that is no power, for one node: cubic pieces made in f64 when the scene loads.
// Twins: src/thermal/function/cubics.rs makes the pieces, src/thermal/function.rs has what they stand for.
// The including shader declares `vec4 shapes[]`: of each function a head (warp, rate at the start, number of turns), its
// pieces, then its turns (share of the time left, relative rate / (1 + relative rate)).

const uint SHAPE_CELLS = 4096u;
const uint SHAPE_STRIDE = 4160u;
const uint SHAPE_TURNS = 4097u; // place of the first turn

struct Shape {
    uint first;       // place of its head
    float warp;
    float start_rate; // f'(0)
    uint turns;
};

// A function at one moment. Of what is done and what is left, the one that is small is exact.
struct ShapePoint {
    float small;
    bool start;  // `small` is the share of the way done; else the share left
    float left;  // w
    float rate;  // f' = dw/dr
    float bend;  // d2w/dr2
};

Shape shape_of(uint number) {
    uint first = number * SHAPE_STRIDE;
    vec4 head = shapes[first];
    return Shape(first, head.x, head.y, uint(head.z));
}

// s: share of the time gone; r = 1 - s: share left.
ShapePoint shape_at(Shape shape, float s, float r) {
    float scale = 1.0 / (1.0 + shape.warp * r);
    float from_start = s * scale;
    float from_end = (1.0 + shape.warp) * r * scale;
    bool start = from_start < from_end;
    float place = min(from_start, from_end) * float(SHAPE_CELLS);
    float cell = min(floor(place), float(SHAPE_CELLS / 2u - 1u));
    float t = place - cell;
    vec4 c = shapes[shape.first + 1u + uint(cell) + (start ? 0u : SHAPE_CELLS / 2u)];
    float small = c.x + t * (c.y + t * (c.z + t * c.w));
    float slope = c.y + t * (2.0 * c.z + 3.0 * t * c.w);
    float curvature = 2.0 * c.z + 6.0 * t * c.w;
    float stretch = float(SHAPE_CELLS) * (1.0 + shape.warp) * scale * scale; // dt/ds
    float bend = curvature * stretch * stretch;
    return ShapePoint(
        small,
        start,
        start ? 1.0 - small : small,
        max(0.0, slope * stretch),
        (start ? -bend : bend) - 2.0 * shape.warp * scale * stretch * slope
    );
}
