#include "core/tex_text.h"

#include <utility>

namespace mbv {
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
