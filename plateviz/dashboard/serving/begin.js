// The session is made while the scripts of the page are loaded and run.
(() => {
  const is_dark = matchMedia("(prefers-color-scheme: dark)").matches
  const size = { width: innerWidth, height: innerHeight, is_dark }
  const body = JSON.stringify({ token: "TOKEN", window: size })
  // A page for which there is no room now, or that comes with too many others, asks again.
  const look_again = answer => {
    const is_empty = () => !window.Bokeh?.documents?.length
    const milliseconds = 3000 + 4000 * Math.random()
    if (answer.status === 429) setTimeout(() => is_empty() && location.reload(), milliseconds)
  }
  // What is shown until the page is drawn would stay behind it.
  const forget = () => {
    const is_drawn = window.Bokeh?.index?.roots?.[0]?.is_idle
    if (is_drawn) document.getElementById("opening").remove()
    else setTimeout(forget, 50)
  }
  document.addEventListener("DOMContentLoaded", forget)
  fetch("session", { method: "POST", body, keepalive: true }).then(look_again).catch(() => {})
})()
