// SSIM: the window (11 taps, sigma 1.5, sum 1), the strip length that one lane filters in registers, and a pixel's
// value.

const uint STRIP = 8u;
const float WINDOW[11] = float[11](0.00102838008447911, 0.00759875813523919, 0.0360007721284308, 0.109360689509700,
    0.213005537711254, 0.266011724861795, 0.213005537711254, 0.109360689509700, 0.0360007721284308, 0.00759875813523919,
    0.00102838008447911);

// Derivatives of SSIM with respect to the filtered mean x, mean x^2 + y^2 and mean x y, and its value: ((2 mx my +
// C1)(2 sxy + C2)) / ((mx^2 + my^2 + C1)(sxx + syy + C2)). Moments: mean x, mean y, mean x^2 + y^2, mean x y.
vec4 ssim(vec4 moments) {
    float mx = moments.x, my = moments.y;
    float squares = mx * mx + my * my, product = mx * my;
    float a = 2.0 * product + SSIM_C1, b = 2.0 * (moments.w - product) + SSIM_C2;
    float c = squares + SSIM_C1, d = moments.z - squares + SSIM_C2;
    float inv = 1.0 / (c * d);
    float value = a * b * inv;
    float v_mean = 2.0 * my * (b - a) * inv + 2.0 * mx * value * (1.0 / d - 1.0 / c);
    return vec4(v_mean, -value / d, 2.0 * a * inv, value);
}
