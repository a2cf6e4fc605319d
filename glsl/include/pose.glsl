// Correction of a camera's pose by the rows of a photo, starting at ROW: six trained numbers in two rows; the fourth
// number of the first row is 1 once the pose is settled, that of the second row is the scene depth in this view. Then
// the six rows of the photo's preconditioner, each in two of these rows. The preconditioner times the numbers is a
// Rodrigues vector in camera space, and a translation in camera space in units of that depth. step_rows and
// shared_parameters are declared before.

float correction(uint k) {
    uint row = ROW + 2u * (k + 1u);
    return dot(shared_parameters[step_rows[row]].xyz, shared_parameters[step_rows[ROW]].xyz)
        + dot(shared_parameters[step_rows[row + 1u]].xyz, shared_parameters[step_rows[ROW + 1u]].xyz);
}

// A vector turned by twice the angle whose tangent is the length of w, half the Rodrigues vector.
vec3 turned(vec3 w, vec3 x) {
    float square = dot(w, w);
    return ((1.0 - square) * x + 2.0 * dot(w, x) * w + 2.0 * cross(w, x)) / (1.0 + square);
}
