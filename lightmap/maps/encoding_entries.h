// What the table of encodings (encodings.cpp) is made of: how each entry is made from conventions that a file states.
// Keys that are missing have their defaults. For this folder alone.
#pragma once

#include <string>

#include "lightmap/maps/encoding.h"

namespace lumel {

Expected<std::shared_ptr<const Encoding>> statedRnmEncoding(const Conventions& conventions);
Expected<std::shared_ptr<const Encoding>> statedSh1Encoding(const Conventions& conventions);
Expected<std::shared_ptr<const Encoding>> statedHBasisEncoding(const Conventions& conventions);
Expected<std::shared_ptr<const Encoding>> statedZh3Encoding(const Conventions& conventions);
Expected<std::shared_ptr<const Encoding>> statedAhdEncoding(const Conventions& conventions);
Expected<std::shared_ptr<const Encoding>> statedDominantEncoding(const Conventions& conventions);

/// sh1 as the line L0 + N.L that is the nearest to irradiance over the hemisphere of normals, exact on flat ones.
std::shared_ptr<const Encoding> fittedSh1Encoding();

/// What `conventions` says under a key, else the name of the usual choice.
std::string statedOr(const Conventions& conventions, const char* key, const char* usual);

/// How an encoding that is linear in direction is projected: as it is (Raw), or exact on flat normals (Flat).
Projection statedExactness(const Conventions& conventions);

}  // namespace lumel
