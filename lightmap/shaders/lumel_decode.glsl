// The light on a normal from the maps of a bake by Lumel: irradiance / pi, so that colour = albedo * light + emission.
// n: the normal map's 2 * texel - 1 (green up), normalised, in the tangent space of scene.glb; (0, 0, 1) without one.
// Arguments before it are the encoding's maps in the order that bake.json names, as looked up, without conversion.

float lumelLuminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

vec3 lumelUnit(vec3 v) {
  float square = dot(v, v);
  return square > float(0.0) ? v * inversesqrt(square) : vec3(0.0, 0.0, 1.0);
}

// Projections raw, flat and fit.
vec3 lumelDecodeRnm(vec3 rnm0, vec3 rnm1, vec3 rnm2, vec3 n) {
  vec3 w = max(vec3(dot(n, vec3(0.8164966, 0.0, 0.5773503)), dot(n, vec3(-0.4082483, 0.7071068, 0.5773503)),
                    dot(n, vec3(-0.4082483, -0.7071068, 0.5773503))),
               vec3(0.0));
  w = w * w;
  return (w.x * rnm0 + w.y * rnm1 + w.z * rnm2) / (w.x + w.y + w.z);
}

// Projection signed.
vec3 lumelDecodeRnmSigned(vec3 rnm0, vec3 rnm1, vec3 rnm2, vec3 n) {
  vec3 w = max(vec3(dot(n, vec3(0.8164966, 0.0, 0.5773503)), dot(n, vec3(-0.4082483, 0.7071068, 0.5773503)),
                    dot(n, vec3(-0.4082483, -0.7071068, 0.5773503))),
               vec3(0.0));
  return max(w.x * rnm0 + w.y * rnm1 + w.z * rnm2, vec3(0.0));
}

vec3 lumelDecodeSh1(vec3 l0, vec3 lx, vec3 ly, vec3 lz, vec3 n) {
  return max(l0 + n.x * lx + n.y * ly + n.z * lz, vec3(0.0));
}

vec3 lumelDecodeH4(vec3 h1, vec3 h2, vec3 h3, vec3 h4, vec3 n) {
  float k1 = float(0.398942280);
  float k = float(0.690988299);
  return max(k1 * h1 + k * (n.y * h2 + (n.z + n.z - float(1.0)) * h3 + n.x * h4), vec3(0.0));
}

vec3 lumelDecodeZh3(vec3 l0, vec3 lx, vec3 ly, vec3 lz, vec3 zonal, vec3 n) {
  float along = dot(n, lumelUnit(vec3(lumelLuminance(lx), lumelLuminance(ly), lumelLuminance(lz))));
  float legendre = float(1.5) * along * along - float(0.5);
  return max(l0 + n.x * lx + n.y * ly + n.z * lz + legendre * zonal, vec3(0.0));
}

vec3 lumelDecodeAhd(vec3 ambient, vec3 light, vec3 direction, vec3 n) {
  vec3 d = lumelUnit(direction + direction - vec3(1.0));
  return ambient + light * max(dot(n, d), float(0.0));
}

vec3 lumelDecodeDominant(vec3 flatLight, vec3 direction, vec3 n) {
  float halfCosine = dot(n, direction - vec3(0.5)) + float(0.5);
  return flatLight * max(halfCosine / max(direction.z, float(0.0001)), float(0.0));
}
