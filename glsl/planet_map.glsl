// A planet that is not uniform: its radiance over that of its mean temperature. Twin: src/thermal/planet_map.rs.

#include "planet.glsl"

layout(set = 0, binding = 16) uniform PlanetViewBlock { PlanetView planet_view; };
layout(set = 0, binding = 17) readonly buffer PlanetMapBlock { float planet_map[]; };

// Four cells of a map around a place, and the way between them.
struct MapPlace {
    uvec4 cells;
    vec2 way;
};

// A direction in the axes of the map.
vec3 on_map(vec3 direction) {
    return vec3(
        dot(planet_view.x.xyz, direction),
        dot(planet_view.y.xyz, direction),
        dot(planet_view.z.xyz, direction)
    );
}

MapPlace map_place(vec3 direction, float columns, float rows) {
    vec4 angles = arc_tangent(
        vec4(abs(direction.y), length(direction.xy), 0.0, 0.0),
        vec4(direction.x, direction.z, 1.0, 1.0)
    );
    float longitude = direction.y < 0.0 ? -angles.x : angles.x;
    float column = (longitude / (2.0 * PI) + 0.5) * columns - 0.5;
    // The poles lie half a row from the centres beside them.
    float down = angles.y / PI * rows;
    float row = clamp(max(min(2.0 * down, down + 0.5), 2.0 * down - rows + 1.0), 0.0, rows + 1.0);
    float left = floor(column);
    float top = min(floor(row), rows);
    float west = left < 0.0 ? columns - 1.0 : min(left, columns - 1.0);
    float east = west + 1.0 < columns ? west + 1.0 : 0.0;
    uint above = uint(top) * uint(columns);
    uint below = above + uint(columns);
    uvec4 cells = uvec4(above + uint(west), above + uint(east), below + uint(west), below + uint(east));
    return MapPlace(cells, vec2(column - left, row - top));
}

// The planet where a ray meets it. `inside` is the sine of the angle from the ray to the limb.
float planet_seen(Surroundings around, vec3 direction, float inside) {
    float sine = around.nadir.w;
    float along = dot(direction, around.nadir.xyz);
    float across = length(cross(direction, around.nadir.xyz));
    float outside = along * sine + across * around.planet_cosine;
    float steep = min(across / sine, 1.0);
    float straight = sqrt(max(inside * outside, 0.0)) / sine;
    vec3 sideways = (direction - along * around.nadir.xyz) / max(across, 1e-20);
    vec3 point = (steep * along - straight * across) * sideways
        - (straight * along + steep * across) * around.nadir.xyz;
    MapPlace place = map_place(on_map(point), planet_view.x.w, planet_view.y.w);
    float above = mix(planet_map[place.cells.x], planet_map[place.cells.y], place.way.x);
    float below = mix(planet_map[place.cells.z], planet_map[place.cells.w], place.way.x);
    return mix(above, below, place.way.y);
}
