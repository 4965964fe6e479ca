#include "regress/index_assets.h"

namespace mbv {

// Below 1200 px a scenario is a card; the table's head stays as a bar of sorting buttons.
const char* const kIndexStyle = R"css(
:root{color-scheme:light dark;--text:#1b1f24;--soft:#57606a;--back:#fff;--line:#d0d7de;--head:#f6f8fa;
--good:#1a7f37;--bad:#cf222e;--warn:#8a5a00;--link:#0550ae;--bad-back:#fff2f1;--warn-back:#fff9e8}
@media (prefers-color-scheme:dark){:root{--text:#e6edf3;--soft:#9aa4af;--back:#0d1117;--line:#30363d;
--head:#161b22;--good:#3fb950;--bad:#ff7b72;--warn:#d29922;--link:#79c0ff;--bad-back:#2a1314;
--warn-back:#251d0c}}
*{box-sizing:border-box}
body{margin:1.5rem auto;max-width:100rem;padding:0 1rem;background:var(--back);color:var(--text);
font:15px/1.45 system-ui,sans-serif}
h1{font-size:1.5rem;margin:0}h2{font-size:1.1rem;margin:0}p{margin:.4rem 0}a{color:var(--link)}
.soft{color:var(--soft)}.counts{font-size:1.1rem}
.box{border:1px solid var(--line);border-left:.4rem solid var(--line);border-radius:6px;
padding:.6rem .9rem;margin:.8rem 0;overflow-wrap:anywhere}
.box.bad{border-left-color:var(--bad);background:var(--bad-back)}
.box.warn{border-left-color:var(--warn);background:var(--warn-back)}
.box>ul,.box details>ul{list-style:none;padding:0;margin:.4rem 0 0}
.box li{margin:.45rem 0 0}.box li>a{font-weight:600}
.box ul ul,.notes ul{margin:0;padding-left:1.2rem;list-style:disc}.box ul ul li{margin:.1rem 0 0}
.box summary{margin-top:.5rem}
form{display:flex;flex-wrap:wrap;gap:.75rem;align-items:end;margin:1rem 0}
input,select{font:inherit;padding:.3rem .5rem;border:1px solid var(--soft);border-radius:6px;
background:var(--back);color:inherit;max-width:100%}
label{display:flex;flex-direction:column;font-size:.85rem}
table{border-collapse:collapse;width:100%}th,td{border-top:1px solid var(--line);padding:.45rem .6rem;
text-align:left;vertical-align:top}
thead{position:sticky;top:-1px;z-index:1;background:var(--head)}thead th,thead td{background:var(--head)}
th button{all:unset;cursor:pointer;font-weight:600}
th button:focus-visible,a:focus-visible{outline:2px solid var(--link);outline-offset:2px}
th[aria-sort=ascending] button::after{content:" ▲"}th[aria-sort=descending] button::after{content:" ▼"}
tbody th{font-weight:600;min-width:14rem;overflow-wrap:anywhere}
tbody tr{scroll-margin-top:4rem}tbody tr:target{background:var(--head)}
th .soft,caption{font-weight:400}caption{text-align:left;padding-bottom:.4rem}
.notes{min-width:14rem;overflow-wrap:anywhere}.notes p{margin:0 0 .3rem}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.good{color:var(--good)}.bad{color:var(--bad)}.warn{color:var(--warn)}.word{font-weight:600}
.box.bad,.box.warn{color:inherit}
img{display:block;border-radius:4px;max-width:144px;height:auto}svg{display:block}
.curve{fill:none;stroke:var(--link);stroke-width:1.5}.limit{stroke:var(--bad);stroke-dasharray:3 3}
.now{fill:var(--link)}pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:.8rem;margin:.3rem 0}
@media (max-width:75rem){
table,tbody,caption{display:block}
thead{display:block;border-bottom:1px solid var(--line)}
thead tr{display:flex;overflow-x:auto}
thead th{border:0;white-space:nowrap;padding:.6rem .7rem}
thead .plain{display:none}
tbody tr{display:grid;grid-template-columns:repeat(auto-fill,minmax(8.5rem,1fr));gap:.2rem .8rem;
border-top:1px solid var(--line);padding:.7rem 0}
tbody tr[hidden]{display:none}
tbody td,tbody th{border:0;padding:0;min-width:0}
tbody th,tbody .picture,tbody .notes,tbody .course{grid-column:1/-1}
tbody td:empty{display:none}
tbody td[data-label]{text-align:left}
tbody td[data-label]::before{content:attr(data-label);display:block;color:var(--soft);font-size:.8rem;
font-weight:400}
}
@media (max-width:40rem){body{margin:.7rem auto;padding:0 .7rem}h1{font-size:1.3rem}
form label{flex:1 1 9rem}}
@media print{thead{position:static}form{display:none}}
)css";

// The state of filter and order is the part of the address after "#?", so that it can be sent, and
// the way back leads through it. "#case/…" leads to a row.
const char* const kIndexScript = R"js(
'use strict';
const body=document.querySelector('tbody'),rows=[...body.rows];
const find=document.getElementById('find'),kind=document.getElementById('kind'),
shown=document.getElementById('shown'),heads=[...document.querySelectorAll('thead th[data-key]')];
const usual={key:'result',up:true};
let order={...usual},typing=false;
function filter(){let n=0;const words=find.value.toLowerCase().split(/\s+/);
for(const r of rows){const text=r.textContent.toLowerCase();
const fits=!kind.value||(kind.value==='must_fail'?'mustFail' in r.dataset:r.dataset.kind===kind.value);
r.hidden=!(words.every(w=>text.includes(w))&&fits);n+=r.hidden?0:1;}
shown.textContent=n+' of '+rows.length+' scenarios';}
function sort(){const th=heads.find(h=>h.dataset.key===order.key),i=th.cellIndex;
heads.forEach(h=>h.removeAttribute('aria-sort'));
th.setAttribute('aria-sort',order.up?'ascending':'descending');
const value=r=>{const s=r.cells[i].dataset.sort;return s===undefined?r.cells[i].textContent:s===''?NaN:+s;};
rows.sort((a,b)=>{const x=value(a),y=value(b);
if(Number.isNaN(x)||Number.isNaN(y))return (Number.isNaN(x)?1:0)-(Number.isNaN(y)?1:0);
const c=typeof x==='number'?(x<y?-1:x>y?1:0):x<y?-1:x>y?1:0;return order.up?c:-c;});
rows.forEach(r=>body.append(r));}
function write(push){const p=new URLSearchParams();
if(find.value)p.set('find',find.value);if(kind.value)p.set('show',kind.value);
if(order.key!==usual.key||order.up!==usual.up)p.set('sort',(order.up?'':'-')+order.key);
const hash=p.size===0?'#':'#?'+p;
if(hash===(location.hash||'#'))return;
history[push?'pushState':'replaceState'](null,'',hash);}
function read(){const hash=location.hash,row=hash.length>1&&!hash.startsWith('#?')?
document.getElementById(hash.slice(1)):null;
if(row){if(row.hidden){find.value=kind.value='';filter();}row.scrollIntoView();return;}
const p=new URLSearchParams(hash.startsWith('#?')?hash.slice(2):'');
find.value=p.get('find')||'';kind.value=p.get('show')||'';
if(kind.selectedIndex<0)kind.value='';
const wish=p.get('sort')||usual.key,key=wish.replace(/^-/,'');
order=heads.some(h=>h.dataset.key===key)?{key,up:!wish.startsWith('-')}:{...usual};
filter();sort();}
find.addEventListener('input',()=>{filter();write(!typing);typing=true;});
find.addEventListener('change',()=>{typing=false;});
kind.addEventListener('change',()=>{filter();write(true);});
document.querySelector('form').addEventListener('submit',e=>e.preventDefault());
heads.forEach(h=>h.querySelector('button').addEventListener('click',()=>{
order={key:h.dataset.key,up:!(order.key===h.dataset.key&&order.up)};sort();write(true);}));
addEventListener('popstate',()=>{typing=false;read();});
filter();sort();read();
)js";

}  // namespace mbv
