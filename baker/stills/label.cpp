#include "baker/stills/label.h"

#include <cctype>

namespace lumel {
namespace {

constexpr int kScale = 3;
constexpr int kColumns = 3;
constexpr int kRows = 5;
constexpr int kAdvance = (kColumns + 1) * kScale;
constexpr int kMargin = (kLabelHeight - kRows * kScale) / 2;

/// Five rows from the top, each a digit whose bits are three pixels, the left one highest.
struct Glyph {
  char character;
  const char* rows;
};

constexpr Glyph kGlyphs[] = {
    {'0', "75557"}, {'1', "26227"}, {'2', "61247"}, {'3', "61216"}, {'4', "55711"}, {'5', "74616"}, {'6', "34752"},
    {'7', "71122"}, {'8', "25252"}, {'9', "25716"}, {'A', "25755"}, {'B', "65656"}, {'C', "34443"}, {'D', "65556"},
    {'E', "74647"}, {'F', "74644"}, {'G', "34553"}, {'H', "55755"}, {'I', "72227"}, {'J', "11152"}, {'K', "55655"},
    {'L', "44447"}, {'M', "57755"}, {'N', "65555"}, {'O', "25552"}, {'P', "65644"}, {'Q', "25573"}, {'R', "65655"},
    {'S', "34216"}, {'T', "72222"}, {'U', "55557"}, {'V', "55552"}, {'W', "55775"}, {'X', "55255"}, {'Y', "55222"},
    {'Z', "71247"}, {'-', "00700"}, {'.', "00002"}, {'_', "00007"}, {'%', "51245"}, {'/', "11244"}, {'+', "02720"},
    {':', "02020"}, {'=', "07070"}, {'(', "24442"}, {')', "21112"},
};

const char* rowsOf(char character) {
  const char capital = static_cast<char>(std::toupper(static_cast<unsigned char>(character)));
  for (const Glyph& glyph : kGlyphs)
    if (glyph.character == capital) return glyph.rows;
  return "00000";
}

}  // namespace

int labelWidth(std::string_view text) { return static_cast<int>(text.size()) * kAdvance; }

void drawLabel(Image& image, int x, int y, std::string_view text, const Vec3& color) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char* rows = rowsOf(text[i]);
    for (int row = 0; row < kRows * kScale; ++row)
      for (int column = 0; column < kColumns * kScale; ++column) {
        if (((rows[row / kScale] - '0') >> (kColumns - 1 - column / kScale) & 1) == 0) continue;
        const int px = x + static_cast<int>(i) * kAdvance + column, py = y + kMargin + row;
        if (px >= 0 && py >= 0 && px < image.width && py < image.height) image.setRgb(px, py, color);
      }
  }
}

}  // namespace lumel
