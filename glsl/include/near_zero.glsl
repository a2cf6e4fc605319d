// Logarithms and exponentials that keep their relative precision near zero. Vulkan allows `log` an error of 5e-7 near
// 1.
#ifndef NEAR_ZERO_GLSL
#define NEAR_ZERO_GLSL

float minus_log1m(float x) { // -ln(1 - x), x in [0, 1)
    float series = x * (1.0 + x * (1.0 / 2.0 + x * (1.0 / 3.0 + x * (1.0 / 4.0 + x * (1.0 / 5.0 + x * (1.0 / 6.0))))));
    return x < 0.0625 ? series : -log(1.0 - x);
}

float expm1(float x) { // e^x - 1, x >= 0
    float series = x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))));
    return x < 0.25 ? series : exp(x) - 1.0;
}

#endif
