// Names of the files of a bake.
#pragma once

#include <string>
#include <vector>

namespace lumel {

/// Whether a bake writes a file of that name.
bool isBakeFile(const std::string& name);

/// File name of a page's image. `kind`: the name of a map, "flat" or "aux".
std::string pageFileName(std::size_t page, const std::string& kind);

/// File name of a material's ssbump map, image number `image` of the scene, of that MIME type.
std::string ssbumpFileName(int image, const std::string& mimeType);

/// File name of a light volume's description, or of its image of that kind: volumeKinds().
std::string volumeFileName(std::size_t volume);
std::string volumeFileName(std::size_t volume, const std::string& kind);

/// The kinds of a light volume's images: "sh0" to "sh8", "cube0" to "cube5", "points" and "sight".
const std::vector<std::string>& volumeKinds();

/// The kinds of a page's images that hold light: an encoding's maps and the flat one, each once.
std::vector<std::string> lightKinds(const std::vector<std::string>& mapNames);

}  // namespace lumel
