// Correction of a camera's pose by two rows of a photo: a Rodrigues vector in camera space, and a move in camera space in
// units of the depth of the scene there.

// A vector turned by twice the angle whose tangent is the length of w, half the Rodrigues vector.
vec3 turned(vec3 w, vec3 x) {
    float square = dot(w, w);
    return ((1.0 - square) * x + 2.0 * dot(w, x) * w + 2.0 * cross(w, x)) / (1.0 + square);
}
