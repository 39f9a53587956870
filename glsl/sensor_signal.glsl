// From the light of four pixels to their digital numbers, and back to radiance. Twin: src/thermal/sensor/reading.rs.

// Signal of pixels that see a radiance, with the share `vignette` of the light.
vec4 signal_of_radiance(Sensor sensor, vec4 radiance, vec4 vignette) {
    vec4 lens = sensor.optics.x * radiance + sensor.optics.y;
    return vignette * lens + (1.0 - vignette) * sensor.optics.z;
}

// Radiance of the scene for a signal.
vec4 radiance_of_signal(Sensor sensor, vec4 signal, vec4 vignette) {
    return ((signal - (1.0 - vignette) * sensor.optics.z) / vignette - sensor.optics.y) / sensor.optics.x;
}

vec4 digital_number(Sensor sensor, vec4 signal) {
    return clamp(floor(signal * sensor.scale + sensor.offset + 0.5), vec4(0.0), vec4(sensor.most));
}

// Signal in the middle of the interval that a digital number stands for.
vec4 signal_of_number(Sensor sensor, vec4 number) {
    return (number - sensor.offset) / sensor.scale;
}

// Fourth power of the cosine between the lines of sight of four pixels and the axis.
vec4 cos4(Sensor sensor, float x, float y) {
    vec4 across = (vec4(x, x + 1.0, x + 2.0, x + 3.0) + 0.5 - sensor.centre.x) / sensor.focal.x;
    float down = (y + 0.5 - sensor.centre.y) / sensor.focal.y;
    vec4 square = 1.0 + across * across + down * down;
    return 1.0 / (square * square);
}
