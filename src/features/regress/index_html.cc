// index.html: one self-contained page of a regression run.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "base/markup.h"
#include "base/png.h"
#include "base/sha256.h"
#include "features/regress/index_assets.h"
#include "features/regress/summaries.h"
#include "features/regress/trouble_text.h"
#include "plot/svg.h"

namespace mbv {
namespace {

// Kind for the filter and colour: "bad", "warn" or "good".
const char* KindOf(const CaseResult& result) {
  return result.failed() ? "bad" : result.drifts.empty() ? "good" : "warn";
}

constexpr double kLowestValue = 1e-17;  // what is smaller is drawn there: below any round-off
constexpr double kCurveRoom = 0.5, kLimitRoom = 0.3;  // decades above and below

// Course of the key metric on a logarithmic scale, oldest left, with its limit.
std::string Sparkline(const CaseResult& result) {
  constexpr double kWidth = 120.0, kHeight = 32.0, kMargin = 3.0;
  const auto* key = KeyMetric(result);
  std::vector<double> levels;
  for (double value : result.course) levels.push_back(std::log10(std::max(value, kLowestValue)));
  std::erase_if(levels, [](double level) { return !std::isfinite(level); });
  if (key == nullptr || levels.size() < 2) return "";
  const auto [low, high] = std::minmax_element(levels.begin(), levels.end());
  double bottom = *low - kCurveRoom, top = *high + kCurveRoom;
  std::optional<double> limit;
  if (key->second.limit && *key->second.limit > 0.0) {
    limit = std::log10(*key->second.limit);
    top = std::max(top, *limit + kLimitRoom);
    bottom = std::min(bottom, *limit - kLimitRoom);
  }
  const auto y = [&](double level) {
    return kMargin + (kHeight - 2.0 * kMargin) * (top - level) / (top - bottom);
  };
  std::string points;
  double x = 0.0;
  for (size_t i = 0; i < levels.size(); ++i) {
    x = kMargin +
        (kWidth - 2.0 * kMargin) * static_cast<double>(i) / static_cast<double>(levels.size() - 1);
    points += fmt::format("{}{:.1f},{:.1f}", i == 0 ? "" : " ", x, y(levels[i]));
  }
  const std::string content =
      (limit ? SvgShape("path", {{"class", "limit"},
                                 {"d", fmt::format("M0 {:.1f}H{:g}", y(*limit), kWidth)}})
             : "") +
      SvgShape("polyline", {{"class", "curve"}, {"points", points}}) +
      SvgShape("circle", {{"class", "now"}, {"cx", x, 1}, {"cy", y(levels.back()), 1}, {"r", 2.5}});
  return SvgElement(
      "svg",
      {{"width", kWidth},
       {"height", kHeight},
       {"viewBox", fmt::format("0 0 {:g} {:g}", kWidth, kHeight)},
       {"role", "img"},
       {"aria-label",
        fmt::format("last {} runs: {:.1e} to {:.1e}, now {:.1e}", levels.size(),
                    std::pow(10.0, *low), std::pow(10.0, *high), std::pow(10.0, levels.back()))}},
      content);
}

constexpr size_t kChecksOfACase = 5, kChecksOfARow = 1, kCasesInABox = 30;

// Where a case's row is: a name without anything that an address would encode.
std::string RowId(const CaseResult& result) {
  std::string id = EncodeLink(result.key);
  std::replace(id.begin(), id.end(), '%', '~');
  return "case/" + id;
}

std::string ListOf(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<li>" + EscapeMarkup(text) + "</li>";
  return html.empty() ? "" : "<ul>" + html + "</ul>";
}

// What a reader should know beyond the numbers.
std::string Notes(const CaseResult& result) {
  std::string text;
  if (result.failed()) {
    text += "<p class=\"bad\">" + EscapeMarkup(result.reason) + "</p>" +
            ListOf(FailureTexts(result, kChecksOfARow));
  }
  if (!result.drifts.empty()) {
    text += "<p class=\"warn\">" + EscapeMarkup(DriftLine(result)) + "</p>";
  }
  if (!result.failed() && !result.verified) {
    text += "<p class=\"soft\">" + EscapeMarkup(result.reason) + "</p>";
  }
  for (const std::string& caveat : result.caveats) {
    text += "<p class=\"warn\">caveat: " + EscapeMarkup(caveat) + "</p>";
  }
  if (!result.not_compared.empty()) {
    text +=
        fmt::format("<details><summary>{} not compared</summary><ul>", result.not_compared.size());
    for (const Unmeasured& item : result.not_compared) {
      text += "<li>" + EscapeMarkup(item.what) + ": " + EscapeMarkup(item.why) + "</li>";
    }
    text += "</ul></details>";
  }
  if (!result.log_tail.empty()) {
    text += "<details><summary>last output</summary><pre tabindex=\"0\">" +
            EscapeMarkup(result.log_tail) + "</pre></details>";
  }
  return text;
}

std::string Links(const CaseResult& result) {
  const std::string key = EncodeLink(result.key);
  std::string text;
  if (result.has_report) text += fmt::format("<a href=\"{}/report.html\">report</a> ", key);
  if (result.has_folder) text += fmt::format("<a href=\"{}/summary.json\">numbers</a> ", key);
  return text + fmt::format("<a href=\"logs/{}.txt\">log</a>", key);
}

// `severity` is the row's place in the usual order.
std::string Row(const CaseResult& result, const std::string& thumbnail, size_t severity) {
  const auto* key = KeyMetric(result);
  const std::string picture = thumbnail.empty()
                                  ? ""
                                  : fmt::format(
                                        "<img src=\"{}\" alt=\"Mechanism at the first snapshot\" "
                                        "loading=\"lazy\">",
                                        EscapeMarkup(thumbnail));
  std::string row = fmt::format(
      "<tr id=\"{}\" data-kind=\"{}\"{}><td class=\"picture\">{}</td>", EscapeMarkup(RowId(result)),
      KindOf(result), result.expected.verdict == "agree" ? "" : " data-must-fail", picture);
  row += fmt::format("<th scope=\"row\">{}<br><span class=\"soft\">{}</span><br>{}</th>",
                     EscapeMarkup(result.key), EscapeMarkup(result.description), Links(result));
  row += fmt::format("<td class=\"word {}\" data-sort=\"{}\">{}</td>", KindOf(result), severity,
                     EscapeMarkup(WordOf(result)));
  row += fmt::format("<td class=\"n\" data-label=\"error\" data-sort=\"{}\">{}</td>",
                     key == nullptr || !std::isfinite(key->second.value)
                         ? ""
                         : fmt::format("{:.6g}", key->second.value),
                     key == nullptr ? "–" : fmt::format("{:.1e}", key->second.value));
  row += fmt::format(
      "<td class=\"n\" data-label=\"limit\" data-sort=\"{0}\">{0}</td>",
      key == nullptr || !key->second.limit ? "" : fmt::format("{:.1e}", *key->second.limit));
  row += "<td class=\"course\">" + Sparkline(result) + "</td><td class=\"notes\">" + Notes(result) +
         "</td>";
  for (const auto& [label, value] :
       {std::pair{"wall [s]", result.cost.wall_s}, std::pair{"CPU [s]", result.cost.cpu_s}}) {
    row += fmt::format("<td class=\"n\" data-label=\"{0}\" data-sort=\"{1:.3f}\">{1:.1f}</td>",
                       label, value);
  }
  return row + fmt::format(
                   "<td class=\"n\" data-label=\"memory [MiB]\" data-sort=\"{0:.1f}\">{0:.0f}</td>"
                   "</tr>\n",
                   result.cost.peak_mib());
}

// A list with a title; what is beyond kCasesInABox is folded away.
std::string Framed(const char* kind, const char* id, const std::string& title,
                   const std::vector<std::string>& items) {
  if (items.empty()) return "";
  std::string html = fmt::format(
      "<section class=\"box {0}\" aria-labelledby=\"{1}\"><h2 id=\"{1}\">{2} {3}</h2>\n"
      "<ul>",
      kind, id, items.size(), title);
  for (size_t i = 0; i < items.size(); ++i) {
    if (i == kCasesInABox) {
      html += fmt::format("</ul><details><summary>{} more</summary><ul>", items.size() - i);
    }
    html += "<li>" + items[i] + "</li>\n";
  }
  return html + (items.size() > kCasesInABox ? "</ul></details>" : "</ul>") + "</section>\n";
}

// What went wrong, what is gone, what drifted: each in one place, the worst first.
std::string Boxes(const RegressReport& report, const std::vector<const CaseResult*>& cases) {
  std::vector<std::string> failed, missing, drifted;
  for (const CaseResult* result : cases) {
    const std::string link = fmt::format("<a href=\"#{}\">{}</a>", EscapeMarkup(RowId(*result)),
                                         EscapeMarkup(result->key));
    if (result->failed()) {
      failed.push_back(fmt::format("{} <span class=\"word bad\">{}</span>: {}{}", link,
                                   EscapeMarkup(WordOf(*result)), EscapeMarkup(result->reason),
                                   ListOf(FailureTexts(*result, kChecksOfACase))));
    } else if (!result->drifts.empty()) {
      drifted.push_back(link + ": " + EscapeMarkup(DriftLine(*result)));
    }
  }
  for (const MissingCase& item : report.missing) {
    missing.push_back(
        fmt::format("<b>{}</b>: {}", EscapeMarkup(item.key), EscapeMarkup(MissingText(item))));
  }
  return Framed("bad", "failed", "not as expected", failed) +
         Framed(report.fail_on_missing ? "bad" : "warn", "missing", "missing", missing) +
         Framed("warn", "drifted", "drifted", drifted);
}

std::string Head(const RegressReport& report) {
  const int code = ExitCodeOf(report);
  const RunInfo& run = report.run;
  std::string text =
      fmt::format("<h1>Regression: <span class=\"{}\">{}</span></h1>\n<p class=\"counts\">{}</p>\n",
                  code == 0 ? "good" : "bad", code == 0 ? "all as expected" : "not as expected",
                  CountsText(CountCases(report)));
  text += fmt::format(
      "<p class=\"soft\">{}{}{}{}, started {}, {:.1f} s with {} worker{}</p>\n",
      run.id == 0 ? "" : fmt::format("run {}, ", run.id),
      run.label.empty() ? "" : EscapeMarkup(run.label) + ", ", EscapeMarkup(run.program),
      run.shard.empty() ? "" : ", shard " + EscapeMarkup(run.shard), EscapeMarkup(run.started_utc),
      run.wall_s, run.jobs, run.jobs == 1 ? "" : "s");
  for (const std::string& note : report.notes) {
    text += "<p class=\"warn\">" + EscapeMarkup(note) + "</p>\n";
  }
  return text;
}

constexpr const char* kControls = R"html(<form role="search">
<label>Find<input id="find" type="search" placeholder="model, scenario, text"></label>
<label>Show<select id="kind"><option value="">all</option><option value="bad">not as expected</option>
<option value="warn">drift</option><option value="good">as expected</option>
<option value="must_fail">must fail</option></select></label>
<span id="shown" class="soft" role="status"></span></form>
<table><caption class="soft">Error: drive forces, RMS over all drives of one
unit; the worst entry of a stiffness; the largest of an output's place [m] in a
free motion; simulated against analytic where both ran. The worst results come first; a column's
name sorts by it.</caption><thead><tr>
<td class="plain"></td><th scope="col" data-key="scenario"><button>scenario</button></th>
<th scope="col" data-key="result" aria-sort="ascending"><button>result</button></th>
<th scope="col" data-key="error"><button>error</button></th>
<th scope="col" data-key="limit"><button>limit</button></th>
<th scope="col" class="plain">last runs</th><th scope="col" class="plain">notes</th>
<th scope="col" data-key="wall"><button>wall [s]</button></th>
<th scope="col" data-key="cpu"><button>CPU [s]</button></th>
<th scope="col" data-key="memory"><button>memory [MiB]</button></th>
</tr></thead><tbody>
)html";

}  // namespace

std::string ToIndexHtml(const RegressReport& report,
                        const std::map<std::string, std::string>& thumbnails) {
  const std::vector<const CaseResult*> cases = BySeverity(report);
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src {}; script-src {}\">"
      "<title>mbverify regression {}: {}</title><style>{}</style></head><body>\n",
      CspHash(IndexStyle()), CspHash(IndexScript()), EscapeMarkup(report.run.started_utc),
      ExitCodeOf(report) == 0 ? "all as expected" : "not as expected", IndexStyle());
  html += kIndexMain + Head(report) + Boxes(report, cases) + kControls;
  for (size_t i = 0; i < cases.size(); ++i) {
    const auto thumbnail = thumbnails.find(cases[i]->key);
    html += Row(*cases[i], thumbnail == thumbnails.end() ? "" : thumbnail->second, i);
  }
  return html + fmt::format("</tbody></table>\n</main>\n<script>{}</script></body></html>\n",
                            IndexScript());
}

// Thumbnails: PNG → smaller PNG → data URI.

namespace {

constexpr std::uint64_t kMostPixels = 1ULL << 26;  // 8192 × 8192, the largest that is drawn

// Mean of the pixels under each new one, in 32 levels per colour: small files.
Picture Shrink(const Picture& image, int width) {
  // a · b / c without overflow
  const auto share = [](int a, int b, int c) { return static_cast<int>(std::int64_t{a} * b / c); };
  Picture small;
  small.width = std::min(width, image.width);
  small.height = std::max(1, share(image.height, small.width, image.width));
  for (int y = 0; y < small.height; ++y) {
    const int y0 = share(y, image.height, small.height);
    const int y1 = std::max(y0 + 1, share(y + 1, image.height, small.height));
    for (int x = 0; x < small.width; ++x) {
      const int x0 = share(x, image.width, small.width);
      const int x1 = std::max(x0 + 1, share(x + 1, image.width, small.width));
      for (size_t c = 0; c < 3; ++c) {
        unsigned sum = 0;
        for (int v = y0; v < y1; ++v) {
          for (int u = x0; u < x1; ++u) {
            sum += image.rgb[3 * (static_cast<size_t>(v) * static_cast<size_t>(image.width) +
                                  static_cast<size_t>(u)) +
                             c];
          }
        }
        const unsigned mean = sum / static_cast<unsigned>((y1 - y0) * (x1 - x0));
        small.rgb.push_back(static_cast<std::uint8_t>((mean >> 3) * 255 / 31));
      }
    }
  }
  return small;
}

}  // namespace

std::string ThumbnailUri(const std::string& png, int width_px) {
  Picture picture;
  if (width_px < 1 || !DecodePng(png, kMostPixels, &picture)) return "";
  return "data:image/png;base64," + EncodeBase64(EncodePng(Shrink(picture, width_px)));
}

}  // namespace mbv
