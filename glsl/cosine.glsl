// Directions about a normal. Twin: src/exchange/directions.rs.

const float TWO_PI = 6.28318530717959;

// Direction about a unit normal for two numbers in (0, 1), with a probability proportional to the cosine.
vec3 cosine_direction(vec3 normal, vec2 at) {
    float side = normal.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (side + normal.z);
    float b = normal.x * normal.y * a;
    vec3 x = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    vec3 y = vec3(b, side + normal.y * normal.y * a, -normal.y);
    float angle = TWO_PI * (at.y - 0.5);
    float radius = sqrt(at.x);
    return sqrt(max(1.0 - at.x, 0.0)) * normal - radius * (cos(angle) * x + sin(angle) * y);
}
