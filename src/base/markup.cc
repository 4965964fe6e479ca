#include "base/markup.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "base/text.h"

namespace mbv {

std::string EscapeMarkup(std::string_view text) {
  constexpr std::string_view kReplacement = "\uFFFD";
  std::string escaped;
  escaped.reserve(text.size());
  size_t bad = FindNonText(text);
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (i == bad) {
      escaped += kReplacement;
      bad = FindNonText(text, i + 1);
      continue;
    }
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

std::string EscapeScript(std::string json) {
  constexpr std::string_view kLess = "\\u003c";
  for (size_t at = 0; (at = json.find('<', at)) != std::string::npos; at += kLess.size()) {
    json.replace(at, 1, kLess);
  }
  return json;
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
    {"\n", " "},
    {"\r", " "},
    {"\t", " "},
    {"η", "\\ensuremath{\\eta}"},
    {"ζ", "\\ensuremath{\\zeta}"},
    {"χ", "\\ensuremath{\\chi}"},
    {"ξ", "\\ensuremath{\\xi}"},
    {"Φ", "\\ensuremath{\\Phi}"},
    {"Θ", "\\ensuremath{\\Theta}"},
};

}  // namespace

std::string TexText(std::string_view text) {
  std::string out;
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

}  // namespace mbv
