// Nodes and conductors of a network, four nodes at a time. Rows of conductors lie in slices of some groups, each
// as long as its longest row up to a limit. A tail has the conductors beyond the limit. Linear and radiative conductors
// have separate rows, because most nodes of a surface radiate to no other node. On lavapipe the cost is the number of
// loads, not of loaded components.

layout(push_constant) uniform PassBlock { NetworkPass pass; };
// For each group: 1 / C and emission [K/J, W/K4].
layout(set = 0, binding = 0) readonly buffer RowBlock { vec4 rows[]; };
// First linear and first radiative entry of each slice.
layout(set = 0, binding = 1) readonly buffer SliceBlock { uvec2 slices[]; };
layout(set = 0, binding = 2) readonly buffer NeighbourBlock { uvec4 neighbours[]; };
layout(set = 0, binding = 3) readonly buffer ConductanceBlock { vec4 conductances[]; };
#ifdef RADIATIVE
// For each radiative entry: the neighbours of four nodes, then the bits of the radiative conductors [W/K4].
layout(set = 0, binding = 4) readonly buffer RadiatorBlock { uvec4 radiators[]; };
#endif
#ifdef TAILS
// First conductor of each node's tail, then the conductors of all tails.
layout(set = 0, binding = 5) readonly buffer TailBlock { uint tails[]; };
layout(set = 0, binding = 6) readonly buffer LinkBlock { NetworkLink links[]; };
#endif
// Heat [W] and its slope [W/s] of two nodes.
layout(set = 0, binding = 7) readonly buffer HeatBlock { vec4 heat[]; };
// Base and rest [K] of two nodes. A second view of this memory has one node an element.
#ifdef MOVES
layout(set = 0, binding = 8) buffer PresentBlock { vec4 present[]; };
#endif
#ifndef MOVES
layout(set = 0, binding = 8) readonly buffer PresentBlock { vec4 present[]; };
#endif
#ifdef GATHERS
layout(set = 0, binding = 9) readonly buffer GatheredBlock { vec2 gathered[]; };
#endif

const uint GROUPS_OF_SLICE = 4u;

#ifdef LISTED
// Mask of the nodes of a list entry. The entry holds the group, and a bit for each of its nodes below.
vec4 mask_of(uint entry) {
    return vec4(float(entry & 1u), float((entry >> 1u) & 1u), float((entry >> 2u) & 1u), float((entry >> 3u) & 1u));
}
#endif

vec4 base_of(vec4 a, vec4 b) {
    return vec4(a.x, a.z, b.x, b.z);
}

vec4 rest_of(vec4 a, vec4 b) {
    return vec4(a.y, a.w, b.y, b.w);
}

// `radiated` for four nodes.
vec4 radiated_4(vec4 difference, vec4 a, vec4 b) {
    return difference * (a + b) * (a * a + b * b);
}

// `radiative_slope` for four nodes.
vec4 radiative_slope_4(vec4 temperature) {
    return 4.0 * temperature * temperature * temperature;
}

#ifdef GATHERS
// Sum of the magnitudes of the terms [W] in the last call of `heat_into`.
vec4 gross;

#ifdef SUMS
// Sums of the conductances [W/K] and emissions [W/K4] of the group in the last call of `heat_into`.
vec4 conductance_sum;
vec4 emission_sum;
#endif

#ifdef TAILS
// Heat into a node from its tail [W], its magnitude, and the sums of conductances and emissions.
vec4 tail_heat(uint node, float base_here, float rest_here) {
    vec4 sum = vec4(0.0);
    uint end = tails[node + 1u];
    for (uint k = tails[node]; k < end; k++) {
        vec2 there = gathered[links[k].neighbour];
        float difference = temperature_difference(there.x, there.y, base_here, rest_here);
        float flow = links[k].conductance * difference;
        sum += vec4(flow, abs(flow), links[k].conductance, links[k].exchange);
#ifdef RADIATIVE
        float radiation = links[k].exchange * radiated(difference, there.x + there.y, base_here + rest_here);
        sum += vec4(radiation, abs(radiation), 0.0, 0.0);
#endif
    }
    return sum;
}
#endif

// Heat into a group of nodes [W].
vec4 heat_into(uint group, vec4 base_here, vec4 rest_here, float time) {
    vec4 here = base_here + rest_here;
    vec4 heat_a = heat[2u * group];
    vec4 heat_b = heat[2u * group + 1u];
    vec4 power = base_of(heat_a, heat_b);
    vec4 gained = rest_of(heat_a, heat_b) * time;
    vec4 space = vec4(pass.space_temperature);
    vec4 emission = rows[2u * group + 1u];
    vec4 to_space = emission * radiated_4((space - base_here) - rest_here, space, here);
    gross = abs(power) + abs(gained) + abs(to_space);
    vec4 into = power + gained + to_space;
#ifdef SUMS
    conductance_sum = vec4(0.0);
    emission_sum = emission;
#endif
    uint slice = group / GROUPS_OF_SLICE;
    uint place = group % GROUPS_OF_SLICE;
    uvec2 begin = slices[slice];
    uvec2 end = slices[slice + 1u];
    for (uint k = begin.x + place; k < end.x; k += GROUPS_OF_SLICE) {
        uvec4 other = neighbours[k];
        vec2 a = gathered[other.x];
        vec2 b = gathered[other.y];
        vec2 c = gathered[other.z];
        vec2 d = gathered[other.w];
        vec4 base_there = vec4(a.x, b.x, c.x, d.x);
        vec4 rest_there = vec4(a.y, b.y, c.y, d.y);
        vec4 conductance = conductances[k];
        vec4 flow = conductance * ((base_there - base_here) + (rest_there - rest_here));
        into += flow;
        gross += abs(flow);
#ifdef SUMS
        conductance_sum += conductance;
#endif
    }
#ifdef RADIATIVE
    for (uint k = begin.y + place; k < end.y; k += GROUPS_OF_SLICE) {
        uvec4 other = radiators[2u * k];
        vec2 a = gathered[other.x];
        vec2 b = gathered[other.y];
        vec2 c = gathered[other.z];
        vec2 d = gathered[other.w];
        vec4 base_there = vec4(a.x, b.x, c.x, d.x);
        vec4 rest_there = vec4(a.y, b.y, c.y, d.y);
        vec4 difference = (base_there - base_here) + (rest_there - rest_here);
        vec4 exchange = uintBitsToFloat(radiators[2u * k + 1u]);
        vec4 radiation = exchange * radiated_4(difference, base_there + rest_there, here);
        into += radiation;
        gross += abs(radiation);
#ifdef SUMS
        emission_sum += exchange;
#endif
    }
#endif
#ifdef TAILS
    vec4 e = tail_heat(4u * group, base_here.x, rest_here.x);
    vec4 f = tail_heat(4u * group + 1u, base_here.y, rest_here.y);
    vec4 g = tail_heat(4u * group + 2u, base_here.z, rest_here.z);
    vec4 h = tail_heat(4u * group + 3u, base_here.w, rest_here.w);
    into += vec4(e.x, f.x, g.x, h.x);
    gross += vec4(e.y, f.y, g.y, h.y);
#ifdef SUMS
    conductance_sum += vec4(e.z, f.z, g.z, h.z);
    emission_sum += vec4(e.w, f.w, g.w, h.w);
#endif
#endif
    return into;
}
#endif

// Rebased base and rest of two nodes.
vec4 rebased_pair(vec2 base_here, vec2 rest_here) {
    vec2 a = rebase(base_here.x, rest_here.x);
    vec2 b = rebase(base_here.y, rest_here.y);
    return vec4(a, b);
}
