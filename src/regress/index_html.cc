// index.html: one self-contained page of a regression run.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/markup.h"
#include "core/sha256.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light dark;--text:#1b1f24;--soft:#57606a;--back:#fff;--line:#d0d7de;--head:#f6f8fa;
--good:#1a7f37;--bad:#cf222e;--warn:#9a6700;--link:#0550ae}
@media (prefers-color-scheme:dark){:root{--text:#e6edf3;--soft:#9aa4af;--back:#0d1117;--line:#30363d;
--head:#161b22;--good:#3fb950;--bad:#ff7b72;--warn:#d29922;--link:#79c0ff}}
body{margin:1.5rem auto;max-width:100rem;padding:0 1rem;background:var(--back);color:var(--text);
font:15px/1.45 system-ui,sans-serif}
h1{font-size:1.5rem;margin:0}p{margin:.4rem 0}a{color:var(--link)}.soft{color:var(--soft)}
.counts{font-size:1.1rem}.scroll{overflow-x:auto}
form{display:flex;flex-wrap:wrap;gap:.75rem;align-items:end;margin:1rem 0}
input,select{font:inherit;padding:.3rem .5rem;border:1px solid var(--line);border-radius:6px;
background:var(--back);color:inherit}label{display:flex;flex-direction:column;font-size:.85rem}
table{border-collapse:collapse;width:100%}th,td{border-top:1px solid var(--line);padding:.45rem .6rem;
text-align:left;vertical-align:top}thead th{background:var(--head);position:sticky;top:0}
th button{all:unset;cursor:pointer;font-weight:600}th button:focus-visible{outline:2px solid var(--link)}
th[aria-sort=ascending] button::after{content:" ▲"}th[aria-sort=descending] button::after{content:" ▼"}
tbody th{font-weight:600;min-width:14rem;overflow-wrap:anywhere}th .soft,caption{font-weight:400}caption{text-align:left}
.notes{min-width:12rem;overflow-wrap:anywhere}.notes p{margin:0 0 .3rem}.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.good{color:var(--good)}.bad{color:var(--bad)}.warn{color:var(--warn)}.word{font-weight:600}
img{display:block;border-radius:4px;max-width:144px;height:auto}svg{display:block}
.curve{fill:none;stroke:var(--link);stroke-width:1.5}.limit{stroke:var(--bad);stroke-dasharray:3 3}
.now{fill:var(--link)}pre{white-space:pre-wrap;font-size:.8rem;margin:.3rem 0}
)css";

constexpr const char* kScript = R"js(
'use strict';
const body=document.querySelector('tbody'),rows=[...body.rows];
const find=document.getElementById('find'),kind=document.getElementById('kind'),
shown=document.getElementById('shown');
function filter(){let n=0;const words=find.value.toLowerCase().split(/\s+/);
for(const r of rows){const text=r.textContent.toLowerCase();
r.hidden=!(words.every(w=>text.includes(w))&&(!kind.value||r.dataset.kind===kind.value));n+=r.hidden?0:1;}
shown.textContent=n+' of '+rows.length+' scenarios';}
find.addEventListener('input',filter);kind.addEventListener('change',filter);
document.querySelector('form').addEventListener('submit',e=>e.preventDefault());
document.querySelectorAll('thead button').forEach(button=>button.addEventListener('click',()=>{
const th=button.parentElement,i=th.cellIndex,up=th.getAttribute('aria-sort')!=='ascending';
const value=r=>{const s=r.cells[i].dataset.sort;return s===undefined?r.cells[i].textContent:s===''?Infinity:+s;};
document.querySelectorAll('thead th').forEach(h=>h.removeAttribute('aria-sort'));
th.setAttribute('aria-sort',up?'ascending':'descending');
rows.sort((a,b)=>{const x=value(a),y=value(b);
const c=typeof x==='number'?(x<y?-1:x>y?1:0):x.localeCompare(y);return up?c:-c;});
rows.forEach(r=>body.append(r));}));
filter();
)js";

// Kind for the filter and colour: "bad", "warn" or "good".
const char* KindOf(const CaseResult& result) {
  return result.failed() ? "bad" : result.drifts.empty() ? "good" : "warn";
}

// Course of the key metric on a logarithmic scale, oldest left, with its limit.
std::string Sparkline(const CaseResult& result) {
  constexpr double kWidth = 120.0, kHeight = 32.0, kMargin = 3.0;
  const auto* key = KeyMetric(result);
  std::vector<double> levels;
  for (double value : result.course) levels.push_back(std::log10(std::max(value, 1e-17)));
  std::erase_if(levels, [](double level) { return !std::isfinite(level); });
  if (key == nullptr || levels.size() < 2) return "";
  auto [low, high] = std::minmax_element(levels.begin(), levels.end());
  double bottom = *low - 0.5, top = *high + 0.5;
  std::string limit;
  if (key->second.limit && *key->second.limit > 0.0) {
    top = std::max(top, std::log10(*key->second.limit) + 0.3);
    bottom = std::min(bottom, std::log10(*key->second.limit) - 0.3);
  }
  const auto y = [&](double level) {
    return kMargin + (kHeight - 2.0 * kMargin) * (top - level) / (top - bottom);
  };
  if (key->second.limit && *key->second.limit > 0.0) {
    limit = fmt::format("<path class=\"limit\" d=\"M0 {0:.1f}H{1:g}\"/>",
                        y(std::log10(*key->second.limit)), kWidth);
  }
  std::string points;
  double x = 0.0;
  for (size_t i = 0; i < levels.size(); ++i) {
    x = kMargin +
        (kWidth - 2.0 * kMargin) * static_cast<double>(i) / static_cast<double>(levels.size() - 1);
    points += fmt::format("{}{:.1f},{:.1f}", i == 0 ? "" : " ", x, y(levels[i]));
  }
  return fmt::format(
      "<svg width=\"{0:g}\" height=\"{1:g}\" viewBox=\"0 0 {0:g} {1:g}\" role=\"img\" "
      "aria-label=\"last {2} runs: {3:.1e} to {4:.1e}, now {5:.1e}\">{6}<polyline class=\"curve\" "
      "points=\"{7}\"/><circle class=\"now\" cx=\"{8:.1f}\" cy=\"{9:.1f}\" r=\"2.5\"/></svg>",
      kWidth, kHeight, levels.size(), std::pow(10.0, *low), std::pow(10.0, *high),
      std::pow(10.0, levels.back()), limit, points, x, y(levels.back()));
}

// What a reader should know beyond the numbers.
std::string Notes(const CaseResult& result) {
  std::string text;
  if (result.failed()) text += "<p class=\"bad\">" + EscapeXml(result.reason) + "</p>";
  for (const Drift& drift : result.drifts) {
    text += "<p class=\"warn\">" + EscapeXml(drift.text);
    if (!drift.since.empty()) text += "; since " + EscapeXml(drift.since);
    text += "</p>";
  }
  if (!result.failed() && !result.verified) {
    text += "<p class=\"soft\">" + EscapeXml(result.reason) + "</p>";
  }
  if (!result.not_compared.empty()) {
    text +=
        fmt::format("<details><summary>{} not compared</summary><ul>", result.not_compared.size());
    for (const Unmeasured& item : result.not_compared) {
      text += "<li>" + EscapeXml(item.what) + ": " + EscapeXml(item.why) + "</li>";
    }
    text += "</ul></details>";
  }
  if (!result.log_tail.empty()) {
    text += "<details><summary>last output</summary><pre>" + EscapeXml(result.log_tail) +
            "</pre></details>";
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

std::string Row(const CaseResult& result, const std::string& thumbnail) {
  const auto* key = KeyMetric(result);
  const std::string picture = thumbnail.empty()
                                  ? ""
                                  : fmt::format(
                                        "<img src=\"{}\" alt=\"Mechanism at the first snapshot\" "
                                        "loading=\"lazy\">",
                                        EscapeXml(thumbnail));
  std::string row = fmt::format("<tr data-kind=\"{}\"><td>{}</td>", KindOf(result), picture);
  row += fmt::format("<th scope=\"row\">{}<br><span class=\"soft\">{}</span><br>{}</th>",
                     EscapeXml(result.key), EscapeXml(result.description), Links(result));
  row += fmt::format("<td class=\"word {}\">{}</td>", KindOf(result), EscapeXml(WordOf(result)));
  row += fmt::format("<td class=\"n\" data-sort=\"{}\">{}</td>",
                     key == nullptr || !std::isfinite(key->second.value)
                         ? ""
                         : fmt::format("{:.6g}", key->second.value),
                     key == nullptr ? "–" : fmt::format("{:.1e}", key->second.value));
  row += fmt::format(
      "<td class=\"n\" data-sort=\"{0}\">{0}</td>",
      key == nullptr || !key->second.limit ? "" : fmt::format("{:.1e}", *key->second.limit));
  row += "<td>" + Sparkline(result) + "</td><td class=\"notes\">" + Notes(result) + "</td>";
  const double mib = static_cast<double>(result.cost.peak_kib) / 1024.0;
  for (const double value : {result.cost.wall_s, result.cost.cpu_s}) {
    row += fmt::format("<td class=\"n\" data-sort=\"{0:.3f}\">{0:.1f}</td>", value);
  }
  return row + fmt::format("<td class=\"n\" data-sort=\"{0:.1f}\">{0:.0f}</td></tr>\n", mib);
}

std::string Head(const RegressReport& report) {
  const int code = ExitCodeOf(report);
  const RunInfo& run = report.run;
  std::string text =
      fmt::format("<h1>Regression: <span class=\"{}\">{}</span></h1>\n<p class=\"counts\">{}</p>\n",
                  code == 0 ? "good" : "bad", code == 0 ? "all as expected" : "not as expected",
                  CountsText(CountCases(report)));
  text += fmt::format("<p class=\"soft\">{}{}{}{}, started {}, {:.1f} s with {} worker{}</p>\n",
                      run.id == 0 ? "" : fmt::format("run {}, ", run.id),
                      run.label.empty() ? "" : EscapeXml(run.label) + ", ", EscapeXml(run.program),
                      run.shard.empty() ? "" : ", shard " + EscapeXml(run.shard),
                      EscapeXml(run.started_utc), run.wall_s, run.jobs, run.jobs == 1 ? "" : "s");
  for (const std::string& note : report.notes) {
    text += "<p class=\"warn\">" + EscapeXml(note) + "</p>\n";
  }
  return text;
}

constexpr const char* kControls = R"html(<form role="search">
<label>Find<input id="find" type="search" placeholder="model, scenario, text"></label>
<label>Show<select id="kind"><option value="">all</option><option value="bad">not as expected</option>
<option value="warn">drift</option><option value="good">as expected</option></select></label>
<span id="shown" class="soft" role="status"></span></form>
<div class="scroll"><table><caption class="soft">Error: drive forces, RMS over all drives of one
unit; the worst entry of a stiffness; the largest of an output's place [m] in a
free motion; simulated against analytic where both ran. Click a column to sort.</caption><thead><tr>
<td></td><th scope="col"><button>scenario</button></th><th scope="col"><button>result</button></th>
<th scope="col"><button>error</button></th><th scope="col"><button>limit</button></th>
<th scope="col">last runs</th><th scope="col">notes</th><th scope="col"><button>wall [s]</button></th>
<th scope="col"><button>CPU [s]</button></th><th scope="col"><button>memory [MiB]</button></th>
</tr></thead><tbody>
)html";

}  // namespace

std::string ToIndexHtml(const RegressReport& report,
                        const std::map<std::string, std::string>& thumbnails) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src {}; script-src {}\">"
      "<title>mbverify regression {}</title><style>{}</style></head><body>\n",
      CspHash(kStyle), CspHash(kScript), EscapeXml(report.run.started_utc), kStyle);
  html += kIndexMain + Head(report) + kControls;
  for (const CaseResult& result : report.cases) {
    const auto thumbnail = thumbnails.find(result.key);
    html += Row(result, thumbnail == thumbnails.end() ? "" : thumbnail->second);
  }
  return html + "</tbody></table></div>\n</main>\n<script>" + kScript + "</script></body></html>\n";
}

}  // namespace mbv
