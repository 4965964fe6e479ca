#include "report/html_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>

#include "core/demand.h"
#include "core/markup.h"

namespace mbv {
namespace {

std::string CellHtml(const Cell& cell, const char* tag, const char* scope) {
  std::string html = std::string("<") + tag + scope;
  if (cell.number) html += " class=\"n\"";
  html += ">" + (cell.html ? cell.text : Escape(cell.text)) + "</" + tag + ">";
  return html;
}

}  // namespace

std::string Escape(std::string_view text) { return EscapeMarkup(text); }

std::string Base64(std::string_view bytes) { return EncodeBase64(bytes); }

std::string Base64(std::span<const float> values) {
  std::string bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) {
    const auto word = std::bit_cast<std::uint32_t>(value);
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255U);
  }
  return Base64(bytes);
}

std::string ToHtml(const Table& table) {
  std::string html = "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     Escape(table.caption) + "\"><table><caption>" + Escape(table.caption) +
                     "</caption><thead><tr>";
  for (const Cell& cell : table.head) {
    // An empty heading names nothing.
    html += cell.text.empty() ? "<td></td>" : CellHtml(cell, "th", " scope=\"col\"");
  }
  html += "</tr></thead><tbody>\n";
  for (const std::vector<Cell>& row : table.rows) {
    html += "<tr>";
    for (size_t i = 0; i < row.size(); ++i) {
      MBV_DEMAND(row.size() == table.head.size(), row.size());
      html += i == 0 ? CellHtml(row[i], "th", " scope=\"row\"") : CellHtml(row[i], "td", "");
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string NumberOrDash(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
}

std::string Sentence(std::string text) {
  if (text.empty()) return text;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  if (text.back() != '.') text += '.';
  return text;
}

std::string Folded(const std::string& title, const std::string& content) {
  return "<details><summary>" + Escape(title) + "</summary>" + content + "</details>\n";
}

std::string FigureHtml(const std::string& svg) { return "<figure>" + svg + "</figure>\n"; }

std::string Note(const std::string& text) { return "<p class=\"faint\">" + text + "</p>\n"; }

std::string Pill(const char* kind, const std::string& text) {
  return fmt::format("<span class=\"pill {}\">{}</span>", kind, Escape(text));
}

std::string Card(const std::string& title, const std::string& value, const std::string& detail) {
  return fmt::format("<div class=\"card\"><dt>{}</dt><dd><b>{}</b>{}</dd></div>\n", Escape(title),
                     Escape(value), detail.empty() ? "" : "<span>" + Escape(detail) + "</span>");
}

std::string Spaced(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

}  // namespace mbv
