"""The style sheet of the demo's page: light and dark, from phone to wide screen, nothing loaded from elsewhere."""

CSS = """
:root {
  color-scheme: light dark;
  --paper: #fbfbf9; --card: #ffffff; --ink: #1d2329; --soft: #59636e; --line: #e2e4e0;
  --accent: #0b5f4d; --failed: #b3231b; --code: #f1f2ee; --shadow: 0 1px 2px #0000000d, 0 6px 24px #0000000a;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14181c; --card: #1c2227; --ink: #e8ebed; --soft: #9da7b0; --line: #2e363d;
    --accent: #4fc9a6; --failed: #ff8a80; --code: #232a30; --shadow: none;
  }
  figure a { filter: brightness(.93); }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.6 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif;
}
main, header.top { max-width: 72rem; margin: 0 auto; padding: 0 1.25rem; }
header.top { padding-top: 3rem; padding-bottom: .5rem; }
.mark { color: var(--accent); font-weight: 650; letter-spacing: .04em; margin: 0 0 .6rem; }
h1 { font-size: clamp(1.7rem, 4.2vw, 2.7rem); line-height: 1.15; letter-spacing: -.02em; margin: 0 0 .8rem;
  text-wrap: balance; }
.lead { font-size: 1.14rem; color: var(--soft); max-width: 48rem; margin: 0; text-wrap: pretty; }
section { margin: 3rem 0; }
h2 { font-size: 1.35rem; letter-spacing: -.01em; margin: 0 0 .3rem; }
section > p { color: var(--soft); max-width: 48rem; margin: .2rem 0 1rem; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(11.5rem, 1fr)); gap: .9rem; margin: 2rem 0 0; }
.figures div, figure, .scroll, .facts { background: var(--card); border: 1px solid var(--line);
  border-radius: 12px; box-shadow: var(--shadow); }
.figures div { padding: .9rem 1.1rem 1rem; }
.figures dt { color: var(--soft); font-size: .86rem; }
.figures dd { margin: 0; font-size: 1.75rem; font-weight: 620; letter-spacing: -.02em; line-height: 1.25; }
.figures dd + dd { color: var(--soft); font-size: .84rem; font-weight: 400; letter-spacing: 0; line-height: 1.4; }
.gallery { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, var(--least)), 1fr)); }
.small { --least: 9.5rem; } .large { --least: 30rem; } .whole { grid-template-columns: 1fr; }
figure { margin: 0; overflow: hidden; display: flex; flex-direction: column; }
figure a { display: block; background: #fff; }
figure img { display: block; width: 100%; height: auto; }
.large figure img, .whole figure img { padding: .75rem; }
figcaption { padding: .6rem .9rem .7rem; color: var(--soft); font-size: .88rem; line-height: 1.45;
  border-top: 1px solid var(--line); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; font-variant-numeric: tabular-nums; }
th, td { padding: .5rem .55rem; text-align: right; white-space: nowrap; vertical-align: top;
  border-bottom: 1px solid var(--line); line-height: 1.35; }
thead th { color: var(--soft); font-weight: 500; white-space: normal; vertical-align: bottom; font-size: .82rem; }
th:first-child { text-align: left; position: sticky; left: 0; background: var(--card); }
tbody th { font-weight: 600; }
th.words, td.words { text-align: left; }
td.long { white-space: normal; min-width: 22rem; }
.warning { border-left: .3rem solid #b3261e; padding-left: .8rem; }
tbody tr:last-child > * { border-bottom: 0; }
td small, th small { display: block; color: var(--soft); font-weight: 400; font-size: .8rem; }
.failed { color: var(--failed); font-weight: 600; }
.notes { color: var(--soft); font-size: .87rem; margin: .7rem 0 0; padding: 0; list-style: none; }
details { margin-top: 1rem; }
summary { cursor: pointer; color: var(--accent); font-weight: 550; margin-bottom: .8rem; }
pre { background: var(--code); border: 1px solid var(--line); border-radius: 10px;
  padding: .8rem 1rem; overflow-x: auto;
  font: .88rem/1.6 ui-monospace, SFMono-Regular, Menlo, Consolas, "Liberation Mono", monospace; margin: 0 0 1rem; }
.facts { display: grid; grid-template-columns: max-content 1fr; margin: 0; padding: .4rem 0; font-size: .92rem; }
.facts dt, .facts dd { padding: .35rem 1.1rem; margin: 0; overflow-wrap: anywhere; }
.facts dt { color: var(--soft); }
@media (max-width: 36rem) {
  header.top { padding-top: 1.8rem; } section { margin: 2.2rem 0; }
  .figures { grid-template-columns: 1fr 1fr; } .figures dd { font-size: 1.4rem; }
  .large figure img, .whole figure img { padding: .35rem; }
  .facts { grid-template-columns: 1fr; } .facts dd { padding-top: 0; } .facts dt { padding-bottom: 0; }
}
"""
