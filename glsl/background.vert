#version 450
// A triangle over the whole image at the far plane.

void main() {
    vec2 corner = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    // Depth is reversed: 0 is infinitely far.
    gl_Position = vec4(corner, 0.0, 1.0);
}
