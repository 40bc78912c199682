/** The light: the same for discs, points and triangles. */
export const shading = /* glsl */ `
// A gamma of 2, which costs no powers.
vec3 toLinear(vec3 c) { return c * c; }

// n: unit normal, v: towards the eye, both in view space; up: the world's z in view space.
vec3 shade(vec3 albedo, vec3 n, vec3 v, vec3 up, float inside) {
  vec3 key = normalize(vec3(-0.45, 0.62, 0.75));
  vec3 fill = normalize(vec3(0.8, -0.1, 0.45));
  float sky = 0.5 + 0.5 * dot(n, up);
  float diffuse = max(dot(n, key), 0.0);
  float soft = max(0.5 + 0.5 * dot(n, fill), 0.0);
  vec3 ambient = mix(vec3(0.13, 0.11, 0.11), vec3(0.42, 0.43, 0.46), sky);
  vec3 light = ambient + 0.78 * diffuse * vec3(1.0, 0.96, 0.9) + 0.13 * soft * vec3(0.75, 0.85, 1.0);
  float facing = max(dot(n, v), 0.0);
  float grazing = 1.0 - facing;
  float rim = grazing * grazing * grazing * (0.35 + 0.65 * sky);
  float gloss = max(dot(n, normalize(key + v)), 0.0);
  gloss *= gloss; // to the power of 28
  float gloss4 = gloss * gloss;
  float gloss8 = gloss4 * gloss4;
  gloss = gloss8 * gloss4 * gloss;
  gloss *= gloss;
  vec3 c = toLinear(albedo) * light + rim * vec3(0.14, 0.15, 0.17) + gloss * vec3(0.07);
  c = mix(c, vec3(dot(c, vec3(0.3, 0.6, 0.1))) * vec3(0.42, 0.46, 0.52), inside * 0.75);
  return sqrt(min(c, vec3(1.0)));
}
`;
