#version 450
// A triangle over the whole image at the far plane.

// Place in the image, from -1 to 1.
layout(location = 0) out vec2 place;

void main() {
    place = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    // Depth is reversed: 0 is infinitely far.
    gl_Position = vec4(place, 0.0, 1.0);
}
