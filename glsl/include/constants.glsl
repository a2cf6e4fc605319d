// Constants of the algorithm, each written once. `labelgs::shaders::constants` has the same values, bit for bit.
#ifndef CONSTANTS_GLSL
#define CONSTANTS_GLSL

// A splat that covers a pixel with less opacity than this is left out of the pixel.
const float ALPHA_MIN = 1.0 / 255.0;

// Opacity of a splat at a pixel is clamped to this, so that transmittance never reaches zero at once.
const float ALPHA_MAX = 0.99;

// Blending stops before the splat that would take the transmittance below this.
const float TRANSMITTANCE_MIN = 1e-4;

// Added to the diagonal of the projected covariance, in square pixels.
const float COV2D_BLUR = 0.3;

// log2(ALPHA_MIN), for opacities kept as powers of two.
const float LOG2_ALPHA_MIN = log2(1.0 / 255.0);

#endif
