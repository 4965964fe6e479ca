#include "base/markup.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "base/text.h"

namespace mbv {

namespace {

// Bytes of the character that begins here.
size_t LengthOf(char first) {
  const auto byte = static_cast<unsigned char>(first);
  return byte < 0xC0 ? 1 : byte < 0xE0 ? 2 : byte < 0xF0 ? 3 : 4;
}

}  // namespace

std::string XmlText(std::string_view text) {
  std::string plain;
  plain.reserve(text.size());
  size_t bad = FindNonText(text);
  for (size_t i = 0; i < text.size();) {
    if (i == bad) {
      plain += "\uFFFD";
      bad = FindNonText(text, ++i);
      continue;
    }
    const size_t length = LengthOf(text[i]);
    if (text[i] == '\r') {
      if (text.substr(i + 1, 1) != "\n") plain += '\n';
    } else if (length == 1) {
      plain += text[i];
    } else {
      plain += OneLine(text.substr(i, length));
    }
    i += length;
  }
  return plain;
}

std::string EscapeMarkup(std::string_view text) {
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : XmlText(text)) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string EncodeLink(std::string_view path) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string link;
  for (const char c : path) {
    const auto u = static_cast<unsigned char>(c);
    const bool plain = (u >= 'a' && u <= 'z') || (u >= 'A' && u <= 'Z') || (u >= '0' && u <= '9') ||
                       std::string_view("-_.~/").find(c) != std::string_view::npos;
    if (plain) {
      link += c;
    } else {
      link += {'%', kDigits[u >> 4U], kDigits[u & 15U]};
    }
  }
  return link;
}

std::string EscapeScript(const std::string& json) {
  std::string escaped;
  for (size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '<') {
      escaped += "\\u003c";
    } else if (json[i] == '\\' && i + 1 < json.size()) {
      // Dump() writes as \uXXXX what misleads; a page shows it so.
      if (json[i + 1] == 'u') escaped += '\\';
      escaped += {json[i], json[++i]};
    } else {
      escaped += json[i];
    }
  }
  return escaped;
}

std::string EncodeBase64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t count = std::min<size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) {
      word = word << 8U | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

namespace {

constexpr std::pair<std::string_view, std::string_view> kTexTexts[] = {
    {"\\", "\\textbackslash{}"},
    {"{", "\\{"},
    {"}", "\\}"},
    {"$", "\\$"},
    {"&", "\\&"},
    {"#", "\\#"},
    {"%", "\\%"},
    {"_", "\\_"},
    {"~", "\\textasciitilde{}"},
    {"^", "\\textasciicircum{}"},
    {"<", "\\ensuremath{<}"},
    {">", "\\ensuremath{>}"},
    {"|", "\\ensuremath{|}"},
    {"\"", "''"},
    {"`", "{`}"},
    {"−", "\\ensuremath{-}"},
    {"±", "\\ensuremath{\\pm}"},
    {"×", "\\ensuremath{\\times}"},
    {"·", "\\ensuremath{\\cdot}"},
    {"°", "\\ensuremath{^{\\circ}}"},
    {"≤", "\\ensuremath{\\leq}"},
    {"≥", "\\ensuremath{\\geq}"},
    {"≠", "\\ensuremath{\\neq}"},
    {"≈", "\\ensuremath{\\approx}"},
    {"→", "\\ensuremath{\\rightarrow}"},
    {"∞", "\\ensuremath{\\infty}"},
    {"√", "\\ensuremath{\\surd}"},
    {"′", "\\ensuremath{'}"},
    {"²", "\\ensuremath{^{2}}"},
    {"³", "\\ensuremath{^{3}}"},
    {"⁻", "\\ensuremath{^{-}}"},
    {"¹", "\\ensuremath{^{1}}"},
    {"₀", "\\ensuremath{_{0}}"},
    {"₁", "\\ensuremath{_{1}}"},
    {"₂", "\\ensuremath{_{2}}"},
    {"₃", "\\ensuremath{_{3}}"},
    {"₄", "\\ensuremath{_{4}}"},
    {"∘", "\\ensuremath{\\circ}"},
    {"–", "--"},
    {"—", "---"},
    {"…", "\\ldots{}"},
    {"“", "``"},
    {"”", "''"},
    {"’", "'"},
    {"µ", "\\ensuremath{\\mu}"},
    {"α", "\\ensuremath{\\alpha}"},
    {"β", "\\ensuremath{\\beta}"},
    {"γ", "\\ensuremath{\\gamma}"},
    {"δ", "\\ensuremath{\\delta}"},
    {"ε", "\\ensuremath{\\varepsilon}"},
    {"θ", "\\ensuremath{\\theta}"},
    {"κ", "\\ensuremath{\\kappa}"},
    {"λ", "\\ensuremath{\\lambda}"},
    {"μ", "\\ensuremath{\\mu}"},
    {"ν", "\\ensuremath{\\nu}"},
    {"π", "\\ensuremath{\\pi}"},
    {"ρ", "\\ensuremath{\\rho}"},
    {"σ", "\\ensuremath{\\sigma}"},
    {"τ", "\\ensuremath{\\tau}"},
    {"φ", "\\ensuremath{\\varphi}"},
    {"ψ", "\\ensuremath{\\psi}"},
    {"ω", "\\ensuremath{\\omega}"},
    {"Δ", "\\ensuremath{\\Delta}"},
    {"Σ", "\\ensuremath{\\Sigma}"},
    {"Ω", "\\ensuremath{\\Omega}"},
    {"é", "\\'e"},
    {"ä", "\\\"a"},
    {"ö", "\\\"o"},
    {"ü", "\\\"u"},
    {"ß", "\\ss{}"},
    {"η", "\\ensuremath{\\eta}"},
    {"ζ", "\\ensuremath{\\zeta}"},
    {"χ", "\\ensuremath{\\chi}"},
    {"ξ", "\\ensuremath{\\xi}"},
    {"Φ", "\\ensuremath{\\Phi}"},
    {"Θ", "\\ensuremath{\\Theta}"},
};

std::string WithoutLineEnds(std::string_view text) {
  std::string plain(text);
  std::ranges::replace_if(
      plain, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return plain;
}

constexpr std::pair<char, std::string_view> kMarkdownTexts[] = {
    {'\\', "\\\\"}, {'|', "\\|"},  {'*', "\\*"},  {'_', "\\_"},   {'`', "\\`"}, {'[', "\\["},
    {']', "\\]"},   {'<', "&lt;"}, {'>', "&gt;"}, {'&', "&amp;"}, {'$', "\\$"}, {'~', "\\~"},
};

}  // namespace

std::string MarkdownText(std::string_view text) {
  const std::string given = OneLine(WithoutLineEnds(text));
  // Between letters an underscore emphasises nothing (CommonMark 6.2).
  const auto is_letter = [&](size_t i) {
    return i < given.size() && std::isalnum(static_cast<unsigned char>(given[i])) != 0;
  };
  std::string out;
  for (size_t i = 0; i < given.size(); ++i) {
    const auto* row =
        std::ranges::find(kMarkdownTexts, given[i], &std::pair<char, std::string_view>::first);
    const bool inside = given[i] == '_' && i > 0 && is_letter(i - 1) && is_letter(i + 1);
    out +=
        row != std::end(kMarkdownTexts) && !inside ? row->second : std::string_view(&given[i], 1);
  }
  return out;
}

std::string MarkdownCode(std::string_view text) {
  const bool plain = !text.empty() && OneLine(text) == text &&
                     text.find_first_of("`|\\<>&") == std::string_view::npos;
  return plain ? "`" + std::string(text) + "`" : MarkdownText(text);
}

std::string TexText(std::string_view given_text) {
  const std::string plain = OneLine(WithoutLineEnds(given_text));
  std::string_view text = plain;
  std::string out;
  // The \\ that ends a row of a table would take these as its own.
  if (text.starts_with('[') || text.starts_with('*')) {
    out = "{" + plain.substr(0, 1) + "}";
    text.remove_prefix(1);
  }
  while (!text.empty()) {
    size_t taken = 1;
    std::string_view given = text.substr(0, 1);
    for (const auto& [from, to] : kTexTexts) {
      if (!text.starts_with(from)) continue;
      given = to;
      taken = from.size();
      break;
    }
    out += given;
    text.remove_prefix(taken);
  }
  return out;
}

// Numbers of a robot's XML.

namespace {

constexpr int kMeasured = 4;  // digits from which on a number is not taken for exact
constexpr int kNothing = 9;   // decimals that are zero before a number that is round-off of zero

// Decimals of a number that was not written as a round one; empty for others, for words and for
// what computing left of a zero (-1.30697e-17).
std::optional<int> DecimalsOf(std::string_view number) {
  const size_t e = number.find_first_of("eE");
  int exponent = 0, decimals = 0, significant = 0;
  if (e != std::string_view::npos) {
    const std::string_view power = number.substr(e + 1 + (number.substr(e + 1, 1) == "+" ? 1 : 0));
    const auto [end, error] = std::from_chars(power.data(), power.data() + power.size(), exponent);
    if (error != std::errc() || end != power.data() + power.size()) return std::nullopt;
  }
  bool after_point = false;
  for (const char c : number.substr(0, e)) {
    if (c == '.') {
      after_point = true;
    } else if (std::isdigit(static_cast<unsigned char>(c)) != 0) {
      if (after_point) ++decimals;
      if (significant > 0 || c != '0') ++significant;
    } else if (c != '-' && c != '+') {
      return std::nullopt;
    }
  }
  if (significant < kMeasured || decimals - exponent - significant >= kNothing) return std::nullopt;
  return decimals - exponent;
}

double RoundingOf(std::vector<int>* decimals) {
  if (decimals->empty()) return 0.0;
  const auto middle = decimals->begin() + static_cast<std::ptrdiff_t>(decimals->size() / 2);
  std::nth_element(decimals->begin(), middle, decimals->end());
  return 0.5 * std::pow(10.0, -*middle);
}

}  // namespace

PrintedRounding RoundingOf(std::string_view xml) {
  using Names = std::initializer_list<std::string_view>;
  const Names positions = {"pos", "xyz", "anchor", "fromto"};
  const Names directions = {"quat", "rpy", "axis", "xyaxes", "zaxis"};
  std::vector<int> lengths, turns, angles;
  bool in_degrees = true;  // `euler`, as MJCF has it
  for (size_t equals = xml.find('='); equals != std::string_view::npos;
       equals = xml.find('=', equals + 1)) {
    size_t last = equals;
    while (last > 0 && std::isspace(static_cast<unsigned char>(xml[last - 1])) != 0) --last;
    size_t first = last;
    while (first > 0 && std::isalnum(static_cast<unsigned char>(xml[first - 1])) != 0) --first;
    const std::string_view name = xml.substr(first, last - first);
    const size_t open = xml.find_first_of("\"'", equals);
    const size_t close = open == std::string_view::npos ? open : xml.find(xml[open], open + 1);
    if (close == std::string_view::npos) break;
    const std::string_view value = xml.substr(open + 1, close - open - 1);
    const auto is_of = [name](const Names& names) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    if (name == "angle") in_degrees = value != "radian";
    std::vector<int>* decimals = is_of(positions)    ? &lengths
                                 : is_of(directions) ? &turns
                                 : name == "euler"   ? &angles
                                                     : nullptr;
    equals = close;
    if (decimals == nullptr) continue;
    for (size_t at = 0; at < value.size();) {
      const size_t end = std::min(value.find_first_of(" \t\r\n", at), value.size());
      if (const auto d = DecimalsOf(value.substr(at, end - at))) decimals->push_back(*d);
      at = end + 1;
    }
  }
  // SDF: <pose>x y z roll pitch yaw</pose>.
  for (size_t at = xml.find("<pose"); at != std::string_view::npos;
       at = xml.find("<pose", at + 1)) {
    const size_t open = std::min(xml.find('>', at), xml.size());
    const std::string_view value = xml.substr(open).substr(0, xml.substr(open).find('<'));
    int k = 0;
    for (size_t from = 1; from < value.size();) {
      const size_t end = std::min(value.find_first_of(" \t\r\n", from), value.size());
      if (end > from) {
        const auto d = DecimalsOf(value.substr(from, end - from));
        if (d) (k < 3 ? lengths : turns).push_back(*d);
        ++k;
      }
      from = end + 1;
    }
  }
  const double degree = std::numbers::pi / 180.0;
  return {
      .length = RoundingOf(&lengths),
      .direction = std::max(RoundingOf(&turns), (in_degrees ? degree : 1.0) * RoundingOf(&angles))};
}

}  // namespace mbv
