// Tells why the page does not start where main.js cannot: a script of its own, in JavaScript that any browser knows.
(function () {
  document.documentElement.className = "scripted";
  var reason = "";

  function show() {
    document.getElementById("progress").hidden = true;
    document.getElementById("message").textContent = reason;
    document.getElementById("message").hidden = false;
    document.body.setAttribute("data-state", "failed");
  }

  function fail(sentence) {
    if (reason) return;
    reason = sentence;
    if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", show);
    else show();
  }

  if (location.protocol === "file:") {
    fail("Opened as a file, the page cannot load its model; serve its folder, for instance with python3 -m http.server.");
  } else if (!("noModule" in document.createElement("script"))) {
    fail("This browser knows no JavaScript modules, which the page is made of; use a current browser.");
  }
  window.addEventListener(
    "error",
    function (event) {
      // From its start on, main.js tells of its own troubles.
      if (document.body && document.body.hasAttribute("data-state")) return;
      if (event.target.tagName === "SCRIPT") {
        fail("The page could not load its script (./main.js); load the page again.");
      } else if (event.target === window) {
        fail("This browser cannot run the page’s script (./main.js); use a current browser.");
      }
    },
    true,
  );
})();
