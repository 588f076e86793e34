var Bt,Om,ly,ir,pd,Kl,Fm,Yl,km,gd,md,cy,wa=Symbol.for("pv"),jl={},Ql=[],uy=/^m(i|n|o|s|text|space)$/,_d=Array.isArray,Bm=Ql.slice,Pr=Object.assign;function Rr(n){n&&n.parentNode&&n.remove()}function $l(n,e,t,i,s){var r={type:n,props:e,key:t,ref:i,__k:null,__:null,__b:0,__e:null,__c:null,constructor:wa,__v:s||++Om,__i:-1,__u:0};return!s&&Bt.vnode&&Bt.vnode(r),r}function xt(n){return n.children}function Zl(n,e){this.props=n,this.context=e,this.__g=0}function sr(n,e){if(e==null)return n.__&&sr(n.__,n.__i+1);for(var t;e<n.__k.length;e++)if((t=n.__k[e])&&t.__e)return t.__e;return typeof n.type!="function"||n.props.__P?null:sr(n)}function hy(n){var e,t=n.__v,i=t.__e,s=[],r=[],o=n.__P;o&&((e=Pr({constructor:wa},t)).__v=t.__v+1,Bt.vnode&&Bt.vnode(e),vd(o,e,t,n.__n,o.namespaceURI,32&t.__u?[i]:null,s,i||sr(t),32&t.__u,r),e.__v=t.__v,e.__.__k[e.__i]=e,Xm(s,e,r),t.__=t.__e=null,e.__e!=i&&zm(e))}function zm(n){if((n=n.__)&&n.__c&&!n.props.__P)return n.__e=null,n.__k.some(function(e){return e&&(n.__e=e.__e)}),zm(n)}function Nm(n){(8&n.__g||(n.__g|=8,ir.push(n),Kl++))&&pd==Bt.debounceRendering||((pd=Bt.debounceRendering)||queueMicrotask)(Vm)}function Vm(){try{for(var n,e=1;ir.length;)ir.length>e&&ir.sort(Fm),n=ir.shift(),e=ir.length,8&n.__g&&hy(n)}finally{(Kl=ir.length)&&(pd||queueMicrotask)(Vm)}}function Gm(n,e,t,i,s,r,o,a,l,c,u){var f,d,p,g,v,m,_=i.__k||Ql,x=e.length;for(l=dy(t,e,_,l,x),f=0;f<x;f++)(p=t.__k[f])!=null&&(d=~p.__i&&_[p.__i]||jl,p.__i=f,m=vd(n,p,d,s,r,o,a,l,c,u),g=p.__e,(d.ref!=p.ref||8&d.__u)&&(d.ref&&xd(d.ref,null,p,d),p.ref&&u.push(p.ref,p.__c||g,p)),v=v||g,4&p.__u?(l=Hm(p,l,n,!d.__v),d.__e&&(d.__e=null)):typeof p.type=="function"&&m!==void 0?l=m:g&&(l=g.nextSibling),p.__u&=-21);return t.__e=v,l}function dy(n,e,t,i,s){var r,o,a,l,c,u,f,d,p,g=t.length,v=g,m=0,_=0,x=n.__k=Array(s);for(r=0;r<s;r++)(o=e[r])!=null&&typeof o!="boolean"&&typeof o!="function"?(typeof o!="object"||o.constructor===String?o=x[r]=$l(null,o):_d(o)?o=x[r]=$l(xt,{children:o}):o.constructor===wa&&o.__b?o=x[r]=$l(o.type,o.props,o.key,o.ref,o.__v):x[r]=o,l=r+m,o.__=n,o.__b=n.__b+1,a=null,~(c=o.__i=fy(o,t,l,v))&&(v--,(a=t[c])&&(a.__u|=2)),a&&a.__v?(o.__u|=16,c==l-1?m--:c==l+1?m++:c!=l&&(c>l?m--:m++,_=1)):(~c||(s>g?m--:s<g&&m++),typeof o.type!="function"&&(o.__u|=4))):x[r]=null;if(_){for(u=[],f=[],r=0;r<s;r++)if((o=x[r])&&16&o.__u){for(m=0,d=u.length;m<d;)u[p=m+d>>1]<o.__i?m=p+1:d=p;u[m]=o.__i,f[r]=m+1}for(m=u.length;r--;)f[r]&&(f[r]==m?m--:x[r].__u|=4)}if(v)for(r=0;r<g;r++)!(a=t[r])||2&a.__u||(a.__e==i&&(i=sr(a)),yd(a,a));return i}function Hm(n,e,t,i){var s,r,o,a;if(typeof n.type=="function"){if(n.props.__P)return e;if(s=n.__k)for(r=0;r<s.length;r++)s[r]&&(s[r].__=n,e=Hm(s[r],e,t,!1));return e}for(e&&!e.parentNode&&(e=sr(n))&&!e.parentNode&&(e=null),o=n.__e,a=e;a&&a.nodeType==8;)a=a.nextSibling;for(o!=a&&(!i&&t.moveBefore&&o.parentNode?t.moveBefore(o,e):t.insertBefore(o,e||null)),e=o;(e=e&&e.nextSibling)&&e.nodeType==8&&!e.data.startsWith("$s"););return e}function fy(n,e,t,i){var s,r=n.key,o=n.type,a=e[t],l=a&&!(2&a.__u);if(a===null&&r==null||l&&r==a.key&&o==a.type)return t;if(i>(l?1:0)){for(s=t-1;s>=0;s--)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s;for(s=t+1;s<e.length;s++)if((a=e[s])&&!(2&a.__u)&&r==a.key&&o==a.type)return s}return-1}function Um(n,e,t){t==null&&(t=""),e[0]=="-"?n.setProperty(e,t):n[e]=t}function ql(n,e,t,i,s){var r,o;if(e=="style")if(typeof t=="string")n.style.cssText=t;else{if(typeof i=="string"&&(n.style.cssText=i=""),i)for(e in i)t&&e in t||Um(n.style,e);if(t)for(e in t)i&&t[e]==i[e]||Um(n.style,e,t[e])}else if(e[0]=="o"&&e[1]=="n")typeof t!="function"&&(t=null),typeof i!="function"&&(i=null),(n.__e||(n.__e={}))[e]=t,t&&i||(o=md[e]||(md[e]=py(e)),(n.__a||(n.__a={}))[e]=gd,r=e!=(e=e.replace(km,"$1")),(e=e.slice(2))[0]<"a"&&(e=e.toLowerCase()),t?n.addEventListener(e,o,r):n.removeEventListener(e,o,r));else{if(s=="http://www.w3.org/2000/svg")e=e.replace(/xlink(H|:h)/,"h").replace(/sName$/,"s");else if(e!="width"&&e!="height"&&e!="href"&&e!="list"&&e!="form"&&e!="tabIndex"&&e!="download"&&e!="rowSpan"&&e!="colSpan"&&e!="role"&&e!="popover"&&e in n)try{return void(n[e]=t??"")}catch{}if(typeof t=="function")return;t==null||t===!1&&e[4]!="-"?n.removeAttribute(e):n.setAttribute(e,e=="popover"&&t==1?"":t)}}function py(n){return function(e){var t=this.__e;if(t){if(t=t[n],e[Yl]==null)e[Yl]=gd++;else if(e[Yl]<this.__a[n])return;return t(Bt.event?Bt.event(e):e)}}}function vd(n,e,t,i,s,r,o,a,l,c){var u,f,d,p,g,v,m,_,x,T,S,R,C,y,M,N,P,D,z=e.type;if(e.constructor!==wa)return null;128&t.__u&&(l=32&t.__u,u=t.__c.__z)&&(e.__u|=l,f=r=[],u.nodeType==8?a=Jl(u,r):r.push(u),a=r[0]||a),(u=Bt.__b)&&u(e);e:if(typeof z=="function"){d=o.length;try{if(_=e.props,x=(u=z.prototype)&&u.render,T=(u=z.contextType)&&i[u.__c],S=u?T?T.props.value:u.__:i,(p=t.__c)?(e.__c=p,2&p.__g&&(p.__g|=1)):(x?e.__c=p=new z(_,S):(e.__c=p=new Zl(_,S),p.constructor=z,p.render=gy),T&&T.sub(p),p.state||(p.state={}),p.__n=i,p.__g|=8,p.__h=[],p.__k=[]),x&&(p.__s||(p.__s=p.state),z.getDerivedStateFromProps&&(p.__s==p.state&&(p.__s=Pr({},p.__s)),Pr(p.__s,z.getDerivedStateFromProps(_,p.__s)))),g=p.props,v=p.state,p.__v=e,t.__c){if(_!==g&&x&&!z.getDerivedStateFromProps&&p.componentWillReceiveProps&&p.componentWillReceiveProps(_,S),e.__v==t.__v&&!(8&p.__g)||!(4&p.__g)&&p.shouldComponentUpdate&&p.shouldComponentUpdate(_,p.__s,S)===!1){e.__v!=t.__v&&(p.props=_,p.state=p.__s,p.__g&=-9),e.__e=t.__e,e.__k=t.__k,e.__k.some(function(G){G&&(G.__=e)}),Ql.push.apply(p.__h,p.__k),p.__k=[],p.__h.length&&o.push(p),a=sr(t);break e}p.componentWillUpdate&&p.componentWillUpdate(_,p.__s,S),x&&p.componentDidUpdate&&p.__h.push(function(){p.componentDidUpdate(g,v,m)})}else x&&!z.getDerivedStateFromProps&&p.componentWillMount&&p.componentWillMount(),x&&p.componentDidMount&&p.__h.push(p.componentDidMount);p.context=S,p.props=_,p.__P=n,p.__g&=-5,R=Bt.__r,C=x?25:0;do p.__g&=-9,R&&R(e),u=p.render(p.props,p.state=p.__s,p.context);while(8&p.__g&&++C<25);x&&(Ql.push.apply(p.__h,p.__k),p.__k=[]),p.state=p.__s,p.getChildContext&&(i=Pr({},i,p.getChildContext())),x&&t.__c&&p.getSnapshotBeforeUpdate&&(m=p.getSnapshotBeforeUpdate(g,v)),y=u&&u.type===xt&&u.key==null?u.props.children:u,_.__P&&(u=a,s=(n=_.__P).namespaceURI,l=r=null,t.props&&t.props.__P!=n&&(t.__k.some(function(G){G&&yd(G,G)}),t.__k=null),a=t.__k?sr(t,0):null),a=Gm(n,_d(y)?y:[y],e,t,i,s,r,o,a,l,c),_.__P&&(e.__e=null,a=u),e.__u&=-161,f&&f.some(Rr),p.__h.length&&o.push(p),1&p.__g&&(p.__g&=-4)}catch(G){if(o.length=d,e.__v=null,l||r)if(G&&G.then){if(e.__u|=128|l,r){for(~(P=r.indexOf(a||void 0))||(P=r.length);(D=r[P-1])&&D.nodeType==8;)P--;for(;P<r.length;P++)if(D=r[P])if(r[P]=null,M){if(D==N)break}else{if(D.nodeType!=8)break;D.data.startsWith("$s")&&(N=Jl(M=D))}}if(!M){for(;a&&a.nodeType==8&&a.nextSibling;)a=a.nextSibling;M=a}(u=Jl(M=e.__c.__z||(e.__c.__z=M)))?(e.__e=M,a=u):e.__e=a,a=a&&a.nextSibling}else r&&r.some(Rr);else e.__e=t.__e;e.__k||(e.__k=t.__k||[]),G&&G.then||Wm(e),Bt.__e(G,e,t)}}else a=e.__e=my(t.__e,e,t,i,s,r,o,l,c,n);return(u=Bt.diffed)&&u(e),a}function Jl(n,e){if(n&&n.nodeType==8&&n.data.startsWith("$s"))for(var t=1;n=n.nextSibling;){if(n.nodeType==8){if(n.data.startsWith("$s"))t++;else if(n.data.startsWith("/$s")&&!--t)return n}e&&e.push(n)}}function Wm(n){n&&(n.__c&&(n.__c.__g|=4),n.__k&&n.__k.some(Wm))}function Xm(n,e,t){for(var i=0;i<t.length;)xd(t[i++],t[i++],t[i++]);Bt.__c&&Bt.__c(e,n),n.some(function(s){try{n=s.__h,s.__h=[],n.some(function(r){r.call(s)})}catch(r){Bt.__e(r,s.__v)}})}function my(n,e,t,i,s,r,o,a,l,c){var u,f,d,p,g,v,m,_,x=t.props||jl,T=e.props,S=e.type;if(S=="svg"?s="http://www.w3.org/2000/svg":S=="math"?s="http://www.w3.org/1998/Math/MathML":s||(s="http://www.w3.org/1999/xhtml"),r){for(u=0;u<r.length;u++)if((g=r[u])&&(S?g.localName==S:g.nodeType==3)){n=g,r[u]=null;break}}if(!n){if(_=c.ownerDocument||document,!S)return _.createTextNode(T);n=_.createElementNS(s,S,T.is?T:c),a&&(Bt.__m&&Bt.__m(e,r),a=!1),r=null}if(S){if(c=S=="template"&&n.content||n,r=S=="textarea"&&T.defaultValue!=null?null:r&&Bm.call(c.childNodes),!a&&r)for(x={},u=0;u<n.attributes.length;u++)x[(g=n.attributes[u]).name]=g.value;for(u in x)g=x[u],u=="dangerouslySetInnerHTML"?d=g:u=="children"||u in T||u=="value"&&"defaultValue"in T||u=="checked"&&"defaultChecked"in T||ql(n,u,null,g,s);for(u in T)g=T[u],u=="children"?p=g:u=="dangerouslySetInnerHTML"?f=g:u=="value"?v=g:u=="checked"?m=g:a&&typeof g!="function"||x[u]===g||ql(n,u,g,x[u],s);f?(a||d&&(f.__html==d.__html||f.__html==n.innerHTML)||(n.innerHTML=f.__html),e.__k=[]):(d&&(n.textContent=""),(S=="foreignObject"||s=="http://www.w3.org/1998/Math/MathML"&&uy.test(S))&&(s="http://www.w3.org/1999/xhtml"),Gm(c,_d(p)?p:[p],e,t,i,s,r,o,r?r[0]:t.__k&&sr(t,0),a,l),r&&r.some(Rr)),a&&S!="textarea"||(u="value",S=="progress"&&v==null?n.removeAttribute(u):v==null||v===n[u]&&(S!="progress"||v)||ql(n,u,v,x[u],s),u="checked",m!=null&&m!=n[u]&&ql(n,u,m,x[u],s))}else x===T||a&&n.data==T||(n.data=T);return n}function xd(n,e,t,i){try{typeof n=="function"?e?e.__x=n(e)||1:i&&(i=i.__c||i.__e)&&(e=i.__x)&&(i.__x=null,typeof e=="function"?e():n(null)):n.current=e}catch(s){Bt.__e(s,t)}}function yd(n,e,t){var i,s,r,o;if(Bt.unmount&&Bt.unmount(n),!(i=n.ref)||i.current&&i.current!=n.__e||xd(i,null,e,n),i=n.__c){if(i.componentWillUnmount)try{i.componentWillUnmount()}catch(a){Bt.__e(a,e)}i.__P=i.__n=null}if(i=n.__k)for(o=0;o<i.length;o++)i[o]&&yd(i[o],e,typeof n.type!="function"||t&&!n.props.__P);!t&&(i=n.__c)&&(i=i.__z)&&(s=Jl(i,r=[]))&&(i==n.__e&&r.some(Rr),Rr(s),Rr(i)),t||Rr(n.__e),n.__e=n.__c=n.__=null}function gy(n,e,t){return this.constructor(n,t)}function qm(n,e){var t,i,s,r;Bt.__&&Bt.__(n,e),e.nodeType==9&&(e=e.documentElement),i=(t=n&&32&n.__u)?null:e.__k,e.__k=$l(xt,{children:[n]}),s=[],r=[],vd(e,e.__k,i||jl,jl,e.namespaceURI,i?null:e.firstChild?Bm.call(e.childNodes):null,s,i?i.__e:e.firstChild,t,r),Xm(s,e.__k,r),e.__k.props.children=null}Bt={__e:function(n,e,t,i){for(var s,r,o;e=e.__;)if((s=e.__c)&&!(1&s.__g)){s.__g|=4;try{if((o=(r=s.constructor)&&r.getDerivedStateFromError)&&s.setState(r.getDerivedStateFromError(n)),s.componentDidCatch&&(s.componentDidCatch(n,i||{}),o=1),o&&8&s.__g)return void(s.__g|=2)}catch(a){n=a}}throw Kl=0,n}},Om=0,ly=function(n){return n!=null&&n.constructor===wa},Zl.prototype.setState=function(n,e){var t=this.__s;t&&t!=this.state||(t=this.__s=Pr({},this.state)),typeof n=="function"&&(n=n(Pr({},t),this.props)),n&&(Pr(t,n),this.__v&&(e&&this.__k.push(e),Nm(this)))},Zl.prototype.forceUpdate=function(n){this.__v&&(this.__g|=4,n&&this.__h.push(n),Nm(this))},Zl.prototype.render=xt,ir=[],Kl=0,Fm=function(n,e){return n.__v.__b-e.__v.__b},Yl=Symbol(),km=/(PointerCapture)$|Capture$/i,gd=0,md={},cy=0;var Ea,Dn,bd,Ym,Sd=Object.is,ec=0,ng=[],Md=[],En=Bt,$m=En.__b,Zm=En.__r,Jm=En.diffed,Km=En.__c,jm=En.unmount,Qm=En.__;function Td(n,e){En.__h&&En.__h(Dn,n,ec||e),ec=0;var t=Dn.__H||(Dn.__H={__:[],__h:[]});return n>=t.__.length&&t.__.push({}),t.__[n]}function Ce(n){return ec=1,_y(sg,n)}function _y(n,e,t){var i=Td(Ea++,2);if(i.t=n,!i.__c&&(i.__=[t?t(e):sg(void 0,e),function(r){var o=(i.__N||i.__)[0],a=i.t(o,r);Sd(o,a)||(i.__N=[a,i.__[1]],i.__c.setState({}))}],i.__c=Dn,!Dn.__f)){Dn.__f=!0;var s=Dn.shouldComponentUpdate;Dn.shouldComponentUpdate=function(r,o,a){var l=this.__H;if(!l)return!0;var c=!1,u=this.props!=r;if(l.__.some(function(d){d.__N&&(c=!0,Sd(d.__[0],d.__N[0])||(u=!0))}),s){var f=s.call(this,r,o,a);return c?f||u:f}return!c||u}}return i.__}function at(n,e){var t=Td(Ea++,3);!En.__s&&ig(t.__H,e)&&(t.__P=!0,t.__=n,t.u=e,Dn.__H.__h.push(t))}function $t(n){return ec=5,Aa(function(){return{current:n}},[])}function Aa(n,e){var t=Td(Ea++,7);return ig(t.__H,e)&&(t.__=n(),t.__H=e),t.__}function vy(){var n;do{for(;n=Md.shift();)try{Ta(n)}catch(t){En.__e(t,{__:(n=n.__P)&&n.__v})}for(;n=ng.shift();){var e=n.__H;if(n.__P&&e)try{e.__h.some(Ta),e.__h.some(wd),e.__h=[]}catch(t){e.__h=[],En.__e(t,n.__v)}}}while(Md.length)}En.__b=function(n){Dn=null,$m&&$m(n)},En.__=function(n,e){n&&e.__k&&e.__k.__m&&(n.__m=e.__k.__m),Qm&&Qm(n,e)},En.__r=function(n){Zm&&Zm(n),Ea=0;var e=(Dn=n.__c).__H;e&&(bd==Dn?Dn.__h=[]:(e.__h.some(Ta),e.__h.some(wd),Ea=0),e.__h=[],e.__.some(function(t){t.__N&&(t.__=t.__N),t.u=t.__N=void 0})),bd=Dn},En.diffed=function(n){Jm&&Jm(n);var e=n.__c;e&&e.__H&&(e.__H.__h.length&&tg(ng.push(e)),e.__H.__.some(function(t){t.u&&(t.__H=t.u)})),bd=Dn=null},En.__c=function(n,e){e.some(function(t){try{t.__h.some(Ta),t.__h=t.__h.filter(function(i){return!i.__||wd(i)})}catch(i){t.__h=[function(){throw i}]}}),Km&&Km(n,e)},En.unmount=function(n){jm&&jm(n);var e,t,i=n.__c;i&&i.__H&&(i.__H.__.some(function(s){try{if(s.__P&&s.__c){if(t===void 0){for(t=n.__;t&&(!t.__c||!t.__c.__P);)t=t.__;t=t&&t.__c}s.__P=t,tg(Md.push(s))}else Ta(s)}catch(r){e=r}}),i.__H=void 0,e&&En.__e(e,i.__v))};var eg=typeof requestAnimationFrame=="function";function xy(n){var e,t=function(){clearTimeout(i),eg&&cancelAnimationFrame(e),setTimeout(n)},i=setTimeout(t,35);eg&&(e=requestAnimationFrame(t))}function tg(n){n!=1&&Ym==En.requestAnimationFrame||((Ym=En.requestAnimationFrame)||xy)(vy)}function Ta(n){var e=Dn,t=n.__c;typeof t=="function"&&(n.__c=void 0,t()),Dn=e}function wd(n){var e=Dn;n.__c=n.__(),Dn=e}function ig(n,e){return!n||n.length!=e.length||e.some(function(t,i){return!Sd(t,n[i])})}function sg(n,e){return typeof e=="function"?e(n):e}var Ed="cdpr-key",yy="robot",tc=()=>new URLSearchParams(location.hash.slice(1)),rg=n=>[...n.keys()].find(e=>e!=="key"&&n.get(e)==="")??yy,Zi=(n,e={})=>`#${[n,...Object.keys(e).length?[new URLSearchParams(e)]:[]].join("&")}`;function og(){let n=tc(),e=n.get("key");return e&&(sessionStorage.setItem(Ed,e),history.replaceState(null,"",Zi(rg(n)))),sessionStorage.getItem(Ed)??""}var ag=n=>sessionStorage.setItem(Ed,n);addEventListener("hashchange",()=>tc().has("key")&&location.reload());function nc(){let[n,e]=Ce(tc);return at(()=>{let t=()=>e(tc());return addEventListener("hashchange",t),()=>removeEventListener("hashchange",t)},[]),{view:rg(n),args:n}}var Cd="The daemon does not answer. Is `cdpr run` still running?",$n=class extends Error{},by="time_s,tension_N,tension_measured,pose,pose_setpoint",Sy=30,cg=1e3,My=1e4,wy=4e3,Ty=401,fo=og(),li=()=>fo!=="";function Rd(n){fo=n,ag(n)}async function Ct(n,e,t,i={},s=null){let r={...i};fo&&(r.Authorization=`Bearer ${fo}`),t!==void 0&&(r["Content-Type"]="application/json");let o;try{o=await fetch(e,{method:n,headers:r,signal:s,body:t===void 0?null:JSON.stringify(t)})}catch{throw new $n(Cd)}o.status===Ty&&Rd("");let a=await o.text();if(o.ok)return JSON.parse(a);let l=a;try{l=JSON.parse(a).error}catch{}throw new $n(l)}function Ir(n,e){let t=!0;return(async()=>{for(;t;)await n(),await new Promise(i=>setTimeout(i,e))})(),()=>{t=!1}}async function sc(n,e){return fo&&(e.ticket=(await Ct("POST","/ticket")).ticket),new WebSocket(`ws://${location.host}${n}?${new URLSearchParams(e)}`)}var ug=null,Ey=0,Ad=new Map,Ay=n=>new Promise(e=>setTimeout(e,n,null)),Cy=300;async function Ca(n){let e=++Ey,t={client:Wn()},i=ug,s=i?.readyState===WebSocket.OPEN,r=new Promise(f=>i?.addEventListener("close",()=>f(null))),o=()=>{},a=f=>{},l=new Promise(f=>o=()=>f(!0)),c=new Promise(f=>a=f);Ad.set(e,f=>f.kind==="taken"?o():a(f));let u=new AbortController;try{s&&i.send(JSON.stringify({...t,do:n,id:e}));let d=s&&await Promise.race([l,c,Ay(Cy)])?r:Ct("POST",`/${n}`,t,{},u.signal).then(()=>null),p=await Promise.race([c,d]);if(p&&!p.ok)throw new $n(p.error??"refused")}finally{u.abort(),Ad.delete(e)}}function hg(n){(async()=>{for(;;){try{await Ry(await sc("/live",{rate_Hz:String(Sy),fields:by}),n)}catch{}n.connected(!1),await new Promise(e=>setTimeout(e,fo?cg:My))}})()}function Ry(n,e){return new Promise(t=>{let i=Date.now();ug=n;let s=setInterval(()=>{Date.now()-i>wy&&n.close()},cg);n.onmessage=({data:r})=>{i=Date.now();let o=JSON.parse(r);o.kind==="cycle"?e.cycle(o):o.kind==="status"?e.status(o.status):o.kind==="event"?e.event(o.event):o.kind==="reply"||o.kind==="taken"?Ad.get(o.id)?.(o):o.kind==="description"&&e.description(o.description),e.connected(!0)},n.onclose=()=>{clearInterval(s),t()}})}var Py=2,lg=500,Iy=5e3,ic=class{#e=null;#t="";#i=0;#n=0;#s=0;#r=null;#o=new Map;seen=0;changed=()=>{};lost=()=>{};get held(){return this.#t!==""}cancel(){this.#n++}async#a(){let{seen:e}=this;if(this.held)return e;let t=this.#n,i=performance.now();if(this.#r??=this.#d().finally(()=>this.#r=null),await this.#r,this.#n!==t)throw new $n("Cancelled: you have stopped the robot.");if(performance.now()-i>Iy)throw new $n("The daemon answered late, so nothing was started. Try again.");return e}async#d(){let e=await sc("/control",{client:Wn(),ttl_s:String(Py)});await new Promise((i,s)=>{e.onmessage=({data:r})=>{let o=JSON.parse(r);o.kind==="held"?(this.#t=o.token,this.#e=e,this.changed(),i()):(this.#o.get(o.id)?.(o),this.#o.delete(o.id))},e.onclose=({reason:r})=>{this.#e===e&&(this.#u(r||"The connection to the daemon was lost."),this.lost(r)),s(new $n(r||"The daemon did not give this page the right to move."))}});let t=setInterval(()=>{this.#e!==e?clearInterval(t):this.renew()},lg)}renew(){let e=performance.now();this.#e?.readyState!==WebSocket.OPEN||e-this.#s<.9*lg||(this.#s=e,this.#e.send(JSON.stringify({do:"renew"})))}release(){let e=this.#e;this.#u("This page has given the right back."),e?.close()}async enable(){await this.request("/enable",{client:Wn(),program:"hold"})}async program(e,t={}){await this.#c({do:"program",program:e,wanted:t})}async set(e){await this.#c({do:"set",wanted:e})}async request(e,t){let i=await this.#a();return Ct("POST",e,t,{"X-Control-Token":this.#t,"X-Stops-Seen":String(i)})}async#c(e){let t=await this.#a(),i=++this.#i,s=await new Promise(r=>{this.#o.set(i,r),this.#e?.send(JSON.stringify({...e,id:i,stops_seen:t,client:Wn()}))});if(!s.ok)throw new $n(s.error??"refused")}async procedure(e){let t=this.held;try{return await this.request("/procedure",{client:Wn(),...e})}catch(i){throw t||this.release(),i}}#u(e){this.#t="",this.#e=null;for(let t of this.#o.values())t({ok:!1,error:e});this.#o.clear(),this.changed()}};function Wn(){let n="cdpr-client",e=sessionStorage.getItem(n);if(e)return e;let t=`page ${Math.floor(Math.random()*65536).toString(16).padStart(4,"0")}`;return sessionStorage.setItem(n,t),t}var rc=n=>Ct("POST",n,{client:Wn()});async function dg(n){let{ticket:e}=await Ct("POST","/ticket");Pd(`${n}?ticket=${e}`,"")}function Pd(n,e){let t=document.createElement("a");t.href=n,t.download=e,t.click()}var Id={configure:"Boot the drives",check:"Check the bus",enable:"Enable",tighten:"Tighten","tighten-home":"Platform stands at home: tighten",acknowledge:"Acknowledge",move:"Move"},Ly={"tighten slack":"Winding in the slack of the cables","tighten pull":"Pulling the cables tight","tighten below":"Measuring friction with less tension","tighten beyond":"Measuring friction with more tension","tighten back":"Returning to the first tensions","tighten lengths":"Measuring the cable lengths","tighten index":"Searching the index of each motor","tighten held":"Settling on tight cables","lower home":"Moving home, above the stand","lower down":"Lowering the platform","lower fade":"Slackening the cables","path to the path":"Moving to the path","path path":"Following the path"},Zn=n=>n.program_progress??{},Ra=n=>n.last_stop??{fallen:!1,broken:[]},Dy=n=>{let e=n.trim();if(!e)return"";let t=e[0].toUpperCase()+e.slice(1);return/[.!?]$/.test(t)?t:`${t}.`},vn=(n,e,t="",i=null)=>({tone:n,title:e,detail:Dy(t),next:i});function pg(n,e,t,i){if(!t&&!li())return vn("off","This page needs its key","Open the address that `cdpr page` prints, or enter the key");if(!t||!n)return vn("off","No connection","The daemon does not answer. This page keeps trying");switch(n.state){case"starting":return vn("busy","Starting","The control loop is starting");case"dead":return vn("fault","The control loop has ended",`${n.reason}. Start it again with \`cdpr run\``);case"fault":return Uy(n,e);case"unconfigured":return n.released?vn("busy","A procedure runs the drives","The control loop takes them again when it ends"):vn("off","Drives not booted",n.reason,"configure");case"inactive":return vn("off","No power",n.reason||"The drives are booted","check");case"ready":return n.read_only?vn("ready","Listening only",n.reason||"Another master moves this robot"):Oy(n,e);case"active":return Fy(n,e,i);default:return vn("off",n.state,n.reason)}}var Ld="Mend everything, in the card Break the simulation, repairs the cables and puts the platform back";function Ny(n,e){return e?.simulated?Ld:`Repair before you enable: ${n.map(t=>t.split(":")[0]).join(", ")}`}function Uy(n,e){let t=n.faults.map(l=>l.text),[i=n.reason,...s]=t,{broken:r}=Ra(n),o=r.length&&e?.simulated?`${Ld}. Then acknowledge`:`${r.length?"Repair the cable":"Remove the cause"}, then acknowledge`,a=s.length?`${o}. After it: ${s.join("; ")}`:o;return vn("fault",`Fault: ${i}`,a,"acknowledge")}function Oy(n,e){let{fallen:t,broken:i}=Ra(n),[,s]=/^disable by (.*)$/.exec(n.commanded??"")??[],o=[/right to move/.test(n.reason)?"":n.reason,s&&`${s} has switched the power off`];return i.length?o.push(Ny(i,e)):t&&o.push("The platform has come down: look at it before you enable"),vn("ready","No power",o.filter(Boolean).join(". ")||"The drives are ready. Keep clear of the robot","enable")}function Fy(n,e,t){let i=Zn(n);if(n.reacting!=="none")return vn("busy","Stopping",n.reason);let s=Ly[`${n.program} ${i.path?.stage??i.stage??""}`];if(e&&n.program==="tighten"&&i.tight===!1)return i.trouble?vn("busy","The cables are not tight",i.trouble.split("; before that, ")[0],fg(n,e).next):vn("busy",s??"Tightening","Keep clear of the robot");if(n.program==="lower")return(i.done??0)<1?vn("busy",s??"Lowering the platform",i.trouble):vn("ready","On its stand","The cables are loose, the power is on","tighten");let r=n.program==="jog"&&(i.done??0)<1;if(e?.platform&&i.tight===!1&&!r)return fg(n,e);if(n.program==="path"&&i.path?.waiting)return vn("on","Paused on the path",i.path.waiting==="paused"?"Resume it in the card Path":i.path.waiting);if(i.done!==void 0&&i.done<1&&n.program!=="hold")return vn("busy",s??"Moving",i.held_back||i.missing||i.trouble);let o=/right to move/.test(n.reason),a=t?"The page or program that led the last motion no longer has the right to move. The robot holds":"",l=i.trouble||n.failure||(o?a:n.reason);return e?.platform?vn("on","Holding the platform",l||"Ready to move: enter a target, drag one in the picture, or choose a path","move"):vn("on","Holding",l)}function fg(n,e){let{fallen:t,broken:i}=Ra(n),s=t||i.length>0,r=s?"The cables are slack. Put the platform on its stand, upright, then tighten from there":n.failure||"The cables are slack";return vn("ready","Power on",s&&e.simulated?`${Ld}. Then tighten`:r,s?"tighten-home":"tighten")}var mg=60,ky=30,Dd=class{status=null;description=null;connected=!1;events=[];rejected="";target=null;path=null;procedure=!1;speed=100;interrupted="";recent=[];right=new ic;cycles=new Set;#e=new Set;#t="";constructor(){this.right.changed=()=>this.change(),this.right.lost=e=>(document.hidden||this.interrupted||this.procedure)&&this.change({rejected:document.hidden?"While this page was in the background, its browser slowed it down. So the page lost the right to move; a motion would have held. The next step takes the right again.":`This page has lost the right to move${e?`: ${e}`:""}. The next step takes it again.`}),hg({description:e=>this.change({description:e.axes?e:null}),status:e=>this.#i(e),event:e=>{let t=(s,r)=>r===0&&e.times>1&&s.text===e.text,i=this.events.filter((s,r)=>s.number!==e.number&&!t(s,r));this.change({events:[e,...i].slice(0,mg)})},cycle:e=>this.#s(e),connected:e=>{if(e===this.connected&&e)return;let t=e&&this.rejected===Cd?"":this.rejected;this.change({connected:e,rejected:t}),e&&this.#r()}})}change(e={}){Object.assign(this,e),this.#e.forEach(t=>t())}#i(e){this.right.seen=e.stop_count;let t=Zn(e),i=e.state==="active"&&(t.done??1)<1;document.hidden&&(i||this.procedure)&&this.right.renew(),e.state!=="active"?this.interrupted="":e.program!=="hold"&&(this.interrupted=(t.done??1)<1?e.program??"":"");let s=t.path?.plan;s&&s!==this.#t&&s!==this.path?.plan&&(this.#t=s,this.#n(s)),this.change({status:e})}async#n(e){let t=await Ct("GET","/path").catch(()=>null);t?.plan===e&&this.change({path:t})}#s(e){let{recent:t}=this;for(t.length&&e.time_s<t[t.length-1].time_s&&(t.length=0),t.push(e);t[0].time_s<e.time_s-ky;)t.shift();this.cycles.forEach(i=>i(e))}async#r(){try{let{events:e}=await Ct("GET","/events");this.change({events:e.reverse().slice(0,mg)})}catch(e){if(!(e instanceof $n))throw e}}listen(e){return this.#e.add(e),()=>this.#e.delete(e)}async attempt(e){this.change({rejected:""});try{await e()}catch(t){if(!(t instanceof $n))throw t;this.change({rejected:t.message})}}},me=new Dd;function ut(){let[,n]=Ce(0);return at(()=>{let e=me.listen(()=>n(t=>t+1));return n(t=>t+1),()=>{e()}},[]),me}function po(n,e){at(()=>(me.cycles.add(n),()=>{me.cycles.delete(n)}),e)}var By=Symbol.for("pv"),zy=0;function h(n,e,t,i,s,r){e||(e={});var o,a,l=e;if("ref"in l&&typeof n!="function")for(a in l={},e)a=="ref"?o=e[a]:l[a]=e[a];var c={type:n,props:l,key:t,ref:o,__k:null,__:null,__b:0,__e:null,__c:null,constructor:By,__v:--zy,__i:-1,__u:0};return(s||r)&&(c.__source=s,c.__self=r),Bt.vnode&&Bt.vnode(c),c}var oc=[1,10,100],Nd=[.5,2,5],Vy=[10,25,50,100],Pa=Math.PI/180,ki=n=>n.controlled.filter(e=>e.length===1),Ia=n=>n.controlled.filter(e=>e.length>1);function Lr(){let{status:n,right:e}=ut();return n?.state!=="active"||Zn(n).tight===!1?"The platform can move once the power is on and the cables are tight.":n.reacting!=="none"?"The robot is stopping.":n.control.procedure?`The ${n.control.procedure} moves the platform.`:n.control.held&&!e.held?`${n.control.client} has the right to move.`:""}var Ud="The platform is outside its box of targets, as at home. Enter a target in the box and press Go; then it can move by steps.";function Od({workspace_min_m:n,workspace_max_m:e},t){return((me.status&&Zn(me.status).position_m)??[]).some((s,r)=>s+t<n[r]||s-t>e[r])}function Fd({name:n,title:e,children:t}){let i=Lr();return h("section",{class:"card","aria-labelledby":n,children:[h("h2",{id:n,children:e}),i&&h("p",{class:"quiet",children:i}),h("fieldset",{disabled:i!=="",children:[h("legend",{class:"hidden",children:e}),t]})]})}function gg(){let{description:n,status:e,right:t}=ut(),i=n?.platform;if(!i||!e||!li())return null;let s=(l,c={})=>()=>{me.attempt(()=>t.program(l,c))},r=Zn(e),o=e.program==="pose"&&(r.done??1)<1,a=e.program==="hold"&&me.interrupted==="pose";return h(Fd,{name:"move",title:"Move",children:[h(Gy,{platform:i}),h(Hy,{platform:i}),h("div",{class:"row",children:[a?h("button",{onClick:s("pose",{resume:!0}),title:"Continue to the target of the move that was stopped",children:"Continue the move"}):h("button",{disabled:!o,onClick:()=>{me.attempt(()=>Ca("hold"))},title:"Stop here, to continue later",children:"Pause"}),h("button",{onClick:s("tighten"),title:"Measure the cables' lengths again, and friction",children:"Tighten again"}),h("button",{onClick:s("lower"),title:"Move home and down onto the stand",children:"Lower"}),t.held&&h("button",{class:"plain",onClick:()=>t.release(),children:"Give up the right to move"})]})]})}function ac(n,e){let t=e.map(Number),i=ki(n).length;return e.some((s,r)=>s.trim()===""||!Number.isFinite(t[r]))?null:{position_m:t.slice(0,i).map(s=>s/1e3),rotation_rad:t.slice(i).map(s=>s*Pa)}}var mo=(n,e)=>n.toFixed(e).replace(/^-(0\.?0*)$/,"$1");function lc(n){let e=me.status&&Zn(me.status),t=Ia(n).map((i,s)=>e?.rotation_rad?.[s]??0);return e?.position_m?[...e.position_m.map(i=>mo(1e3*i,0)),...t.map(i=>mo(i/Pa,1))]:null}var _g=n=>me.speed<100?{speed_m_s:me.speed/100*n.speed_m_s}:{};function cc(n){let{workspace_min_m:e,workspace_max_m:t}=n,i=lc(n)??[],s=(r,o)=>Math.min(Math.max(r,Math.ceil(1e3*e[o])),Math.floor(1e3*t[o]));me.change({target:i.map((r,o)=>o<e.length?String(s(Number(r),o)):r)})}var kd=n=>{let e=me.target&&ac(n,me.target);if(!e)return;me.change({target:null});let t=e.rotation_rad.length?{rotation_rad:e.rotation_rad}:{};me.attempt(()=>me.right.program("pose",{position_m:e.position_m,...t,..._g(n)}))};function Gy({platform:n}){let e=[...ki(n),...Ia(n)],t=ki(n).length,i=me.target??lc(n)??e.map(()=>""),s=ac(n,i)!==null,r=o=>{let[a,l]=o<t?[1e3*n.workspace_min_m[o],1e3*n.workspace_max_m[o]]:[-n.workspace_angle_rad/Pa,n.workspace_angle_rad/Pa];return`${a.toFixed(0)} to ${l.toFixed(0)}`.replace(/-/g,"\u2212")};return h("form",{onSubmit:o=>{o.preventDefault(),kd(n)},children:[h("div",{class:"target",children:e.map((o,a)=>h("label",{children:[h("span",{children:[o,", ",a<t?"mm":"deg"]}),h("input",{inputMode:"decimal",autocomplete:"off",value:i[a],"aria-describedby":`range-${o}`,class:me.target?"":"quiet",onInput:l=>me.change({target:i.map((c,u)=>u===a?l.currentTarget.value:c)})}),h("small",{id:`range-${o}`,children:r(a)})]},o))}),h("div",{class:"row",children:[h("button",{class:"go",disabled:!me.target||!s,children:"Go"}),h("label",{children:["at ",h("select",{"aria-label":"Speed",value:me.speed,onChange:o=>me.change({speed:Number(o.currentTarget.value)}),children:Vy.map(o=>h("option",{value:o,children:[(.01*o*n.speed_m_s*1e3).toFixed(0)," mm/s"]},o))})]}),Object.entries(n.poses_m).map(([o,a])=>h("button",{type:"button",onClick:()=>me.change({target:[...a.map(l=>String(Math.round(1e3*l))),...i.slice(t)]}),children:o},o)),me.target&&h("button",{type:"button",class:"plain",onClick:()=>me.change({target:null}),children:"Discard"})]})]})}function Hy({platform:n}){let[e,t]=Ce(1),[i,s]=Ce("room"),r=ki(n),o=Ia(n),a=Od(n,oc[e]/1e3),l=(u,f,d,p)=>{let g=Array.from({length:f},(v,m)=>m===d?p:0);me.attempt(()=>me.right.program("pose",{[u]:g,frame:i,..._g(n)}))},c=(u,f,d,p,g,v)=>h("div",{class:"jog",children:[h("button",{type:"button","aria-label":`${u} minus ${v}`,onClick:()=>l(f,d,p,-g),children:"\u2212"}),h("span",{children:u}),h("button",{type:"button","aria-label":`${u} plus ${v}`,onClick:()=>l(f,d,p,g),children:"+"})]},u);return h("div",{class:"jogging",children:[h("div",{class:"row",children:[h("label",{children:["Step ",h("select",{value:e,onChange:u=>t(Number(u.currentTarget.value)),children:oc.map((u,f)=>h("option",{value:f,children:[u," mm",o.length?`, ${Nd[f]} deg`:""]},u))})]}),h("label",{children:["along ",h("select",{value:i,onChange:u=>s(u.currentTarget.value),children:[h("option",{value:"room",children:"the room's axes"}),h("option",{value:"platform",children:"the platform's axes"})]})]})]}),a&&h("p",{class:"quiet",children:Ud}),h("fieldset",{class:"row",disabled:a,children:[h("legend",{class:"hidden",children:"Steps"}),r.map((u,f)=>c(u,"distance_m",r.length,f,oc[e]/1e3,`${oc[e]} mm`)),o.map((u,f)=>c(u,"turn_rad",o.length,f,Nd[e]*Pa,`${Nd[e]} deg`))]})]})}var Bd=()=>{me.right.cancel(),me.attempt(()=>Ca("hold"))},Wy=()=>{me.right.cancel(),me.attempt(()=>Ca("disable"))};function vg(){return at(()=>{let n=t=>t instanceof HTMLInputElement&&t.type==="password",e=t=>{t.key==="Enter"&&t.repeat&&t.preventDefault(),!(t.code!=="Space"||n(t.target))&&(t.preventDefault(),t.type==="keydown"&&!t.repeat&&Bd())};return addEventListener("keydown",e,!0),addEventListener("keyup",e,!0),()=>{removeEventListener("keydown",e,!0),removeEventListener("keyup",e,!0)}},[]),h("button",{class:"stop",onPointerDown:Bd,onClick:n=>n.detail===0&&Bd(),title:"Brake and hold with power: press, or space bar",children:["Stop ",h("kbd",{children:"space"})]})}function xg(){let{status:n,connected:e}=ut(),t=e&&n?.state!=="active"&&!n?.released;return h("button",{class:"power",disabled:t,onClick:Wy,title:"Stop the motion, then switch the power off",children:"Power off"})}var Xy={configure:()=>rc("/configure"),check:()=>rc("/check"),enable:()=>me.right.enable(),tighten:()=>me.right.program("tighten"),"tighten-home":()=>me.right.program("tighten",{from:"home"}),acknowledge:()=>rc("/acknowledge")};function zd(){let{status:n,description:e,connected:t,interrupted:i}=ut();return pg(n,e,t,i)}var qy=500,Yy=100;function $y(n){let[e,t]=Ce(null);return at(()=>{let i=setTimeout(()=>t(n),qy);return()=>clearTimeout(i)},[n]),e===n}function yg(){let{rejected:n}=ut();return n?h("p",{class:"rejected",role:"alert",children:[n," ",h("button",{class:"plain",onClick:()=>me.change({rejected:""}),children:"Close"})]}):null}function Zy(){location.hash=Zi("robot"),me.target||cc(me.description.platform),setTimeout(()=>document.querySelector(".target input")?.focus(),Yy)}function bg(){ut();let{tone:n,title:e,detail:t,next:i}=zd(),[s,r]=Ce(!1),o=$y(i),a=Lr()==="",l=s||!o,c=$t(null),u=$t(!1);at(()=>{u.current&&document.activeElement===document.body&&c.current?.focus()},[i]);let f=async(d,p)=>{u.current=p===0,r(!0),await me.attempt(Xy[d]),r(!1)};return h("section",{class:`card situation ${n}`,"aria-label":"State and next step",children:[h("div",{children:[h("h1",{"aria-live":"polite",children:e}),t&&h("p",{children:t})]}),i==="move"&&li()&&a&&h("button",{ref:c,class:"next",onClick:Zy,children:Id[i]}),i&&i!=="move"&&li()&&h("button",{ref:c,class:"next","aria-disabled":l,onClick:({detail:d})=>l||void f(i,d),children:Id[i]}),!li()&&h(Jy,{})]})}function Jy(){let[n,e]=Ce("");return h("form",{class:"key",onSubmit:t=>{t.preventDefault(),Rd(n.trim()),location.reload()},children:[h("label",{children:["Key ",h("input",{type:"password",value:n,autocomplete:"off",onInput:t=>e(t.currentTarget.value)})]}),h("button",{disabled:!n.trim(),children:"Use the key"})]})}var Ky=[["cut-cable","Cut the cable"],["slip","Let the cable slip"],["drive-fault","Fault in the drive"],["encoder-jump","Encoder jumps"],["silence","Drive sends nothing"]];function Sg(){let{description:n}=ut(),[e,t]=Ce(0);if(!n?.simulated||!li())return null;let i=(r,o)=>Ct("POST","/simulated-fault",{axis:o,fault:r,client:Wn()}),s=async()=>{Ra(me.status).fallen&&await i("put-back",0);for(let r of n.axes.keys())await i("mend",r)};return h("section",{class:"card","aria-labelledby":"simulation",children:[h("h2",{id:"simulation",children:"Break the simulation"}),h("div",{class:"row",children:h("label",{children:["Axis ",h("select",{value:e,onChange:r=>t(Number(r.currentTarget.value)),children:n.axes.map(({name:r},o)=>h("option",{value:o,children:r},r))})]})}),h("div",{class:"row",children:Ky.map(([r,o])=>h("button",{onClick:()=>{me.attempt(()=>i(r,e))},children:o},r))}),h("div",{class:"row",children:[h("button",{onClick:()=>{me.attempt(s)},children:"Mend everything"}),h("button",{onClick:()=>{me.attempt(()=>i("put-back",0))},title:"Carry a fallen platform back to its stand",children:"Put the platform back"})]})]})}var _r={LEFT:0,MIDDLE:1,RIGHT:2,ROTATE:0,DOLLY:1,PAN:2},vr={ROTATE:0,PAN:1,DOLLY_PAN:2,DOLLY_ROTATE:3},o_=0,bf=1,a_=2;var gl=1,l_=2,Jo=3,xr=0,pi=1,xi=2,Vr=0,Ko=1,Sf=2,Mf=3,wf=4,c_=5;var Gr=100,u_=101,h_=102,d_=103,f_=104,p_=200,m_=201,g_=202,__=203,Tf=204,Ef=205,v_=206,x_=207,y_=208,b_=209,S_=210,M_=211,w_=212,T_=213,E_=214,Hc=0,Wc=1,Xc=2,Fo=3,qc=4,Yc=5,$c=6,Zc=7,Af=0,A_=1,C_=2,Ss=0,Cf=1,Rf=2,Pf=3,If=4,Lf=5,Df=6,Nf=7;var Uf=300,Hr=301,jo=302,Su=303,Mu=304,Jc=1e3,bs=1001,Kc=1002,qn=1003,R_=1004;var _l=1005;var di=1006,wu=1007;var Xs=1008;var yi=1009,Of=1010,Ff=1011,Qo=1012,Tu=1013,ss=1014,rs=1015,os=1016,Eu=1017,Au=1018,Wr=1020,kf=35902,Bf=35899,zf=1021,Vf=1022,as=1023,Vs=1026,qs=1027,Gf=1028,Cu=1029,yr=1030,Ru=1031;var Pu=1033,vl=33776,xl=33777,yl=33778,bl=33779,Iu=35840,Lu=35841,Du=35842,Nu=35843,Uu=36196,Ou=37492,Fu=37496,ku=37488,Bu=37489,Sl=37490,zu=37491,Vu=37808,Gu=37809,Hu=37810,Wu=37811,Xu=37812,qu=37813,Yu=37814,$u=37815,Zu=37816,Ju=37817,Ku=37818,ju=37819,Qu=37820,eh=37821,th=36492,nh=36494,ih=36495,sh=36283,rh=36284,Ml=36285,oh=36286;var Ga=2300,jc=2301,Vc=2302,df=2303,ff=2400,pf=2401,mf=2402;var P_=3200;var ah=0,I_=1,Ys="",ui="srgb",Ha="srgb-linear",Wa="linear",Dt="srgb";var Gc=7680;var L_=519,D_=512,N_=513,U_=514,Hf=515,O_=516,F_=517,Wf=518,Xf=519,qf=35044;var Yf="300 es",zi=2e3,ko=2001;function jy(n){for(let e=n.length-1;e>=0;--e)if(n[e]>=65535)return!0;return!1}function Qy(n){return ArrayBuffer.isView(n)&&!(n instanceof DataView)}function Xa(n){return document.createElementNS("http://www.w3.org/1999/xhtml",n)}function k_(){let n=Xa("canvas");return n.style.display="block",n}var Mg={},Bo=null;function qa(...n){let e="THREE."+n.shift();Bo?Bo("log",e,...n):console.log(e,...n)}function B_(n){let e=n[0];if(typeof e=="string"&&e.startsWith("TSL:")){let t=n[1];t&&t.isStackTrace?n[0]+=" "+t.getLocation():n[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return n}function Je(...n){n=B_(n);let e="THREE."+n.shift();if(Bo)Bo("warn",e,...n);else{let t=n[0];t&&t.isStackTrace?console.warn(t.getError(e)):console.warn(e,...n)}}function Qe(...n){n=B_(n);let e="THREE."+n.shift();if(Bo)Bo("error",e,...n);else{let t=n[0];t&&t.isStackTrace?console.error(t.getError(e)):console.error(e,...n)}}function za(...n){let e=n.join(" ");e in Mg||(Mg[e]=!0,Je(...n))}function z_(n,e,t){return new Promise(function(i,s){function r(){switch(n.clientWaitSync(e,n.SYNC_FLUSH_COMMANDS_BIT,0)){case n.WAIT_FAILED:s();break;case n.TIMEOUT_EXPIRED:setTimeout(r,t);break;default:i()}}setTimeout(r,t)})}var V_={[Hc]:Hc,[Xc]:$c,[qc]:qc,[Fo]:Yc,[Wc]:Wc,[$c]:Xc,[Zc]:Zc,[Yc]:Fo},es=class{addEventListener(e,t){this._listeners===void 0&&(this._listeners={});let i=this._listeners;i[e]===void 0&&(i[e]=[]),i[e].indexOf(t)===-1&&i[e].push(t)}hasEventListener(e,t){let i=this._listeners;return i===void 0?!1:i[e]!==void 0&&i[e].indexOf(t)!==-1}removeEventListener(e,t){let i=this._listeners;if(i===void 0)return;let s=i[e];if(s!==void 0){let r=s.indexOf(t);r!==-1&&s.splice(r,1)}}dispatchEvent(e){let t=this._listeners;if(t===void 0)return;let i=t[e.type];if(i!==void 0){e.target=this;let s=i.slice(0);for(let r=0,o=s.length;r<o;r++)s[r].call(this,e);e.target=null}}},ei=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"],wg=1234567,Uo=Math.PI/180,zo=180/Math.PI;function br(){let n=Math.random()*4294967295|0,e=Math.random()*4294967295|0,t=Math.random()*4294967295|0,i=Math.random()*4294967295|0;return(ei[n&255]+ei[n>>8&255]+ei[n>>16&255]+ei[n>>24&255]+"-"+ei[e&255]+ei[e>>8&255]+"-"+ei[e>>16&15|64]+ei[e>>24&255]+"-"+ei[t&63|128]+ei[t>>8&255]+"-"+ei[t>>16&255]+ei[t>>24&255]+ei[i&255]+ei[i>>8&255]+ei[i>>16&255]+ei[i>>24&255]).toLowerCase()}function ht(n,e,t){return Math.max(e,Math.min(t,n))}function $f(n,e){return(n%e+e)%e}function eb(n,e,t,i,s){return i+(n-e)*(s-i)/(t-e)}function tb(n,e,t){return n!==e?(t-n)/(e-n):0}function Va(n,e,t){return(1-t)*n+t*e}function nb(n,e,t,i){return Va(n,e,1-Math.exp(-t*i))}function ib(n,e=1){return e-Math.abs($f(n,e*2)-e)}function sb(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*(3-2*n))}function rb(n,e,t){return n<=e?0:n>=t?1:(n=(n-e)/(t-e),n*n*n*(n*(n*6-15)+10))}function ob(n,e){return n+Math.floor(Math.random()*(e-n+1))}function ab(n,e){return n+Math.random()*(e-n)}function lb(n){return n*(.5-Math.random())}function cb(n){n!==void 0&&(wg=n);let e=wg+=1831565813;return e=Math.imul(e^e>>>15,e|1),e^=e+Math.imul(e^e>>>7,e|61),((e^e>>>14)>>>0)/4294967296}function ub(n){return n*Uo}function hb(n){return n*zo}function db(n){return n>0&&Number.isInteger(n)&&2**Math.round(Math.log2(n))===n}function fb(n){return Math.pow(2,Math.ceil(Math.log(n)/Math.LN2))}function Zf(n){return Math.pow(2,Math.floor(Math.log(n)/Math.LN2))}function pb(n,e,t,i,s){let r=Math.cos,o=Math.sin,a=r(t/2),l=o(t/2),c=r((e+i)/2),u=o((e+i)/2),f=r((e-i)/2),d=o((e-i)/2),p=r((i-e)/2),g=o((i-e)/2);switch(s){case"XYX":n.set(a*u,l*f,l*d,a*c);break;case"YZY":n.set(l*d,a*u,l*f,a*c);break;case"ZXZ":n.set(l*f,l*d,a*u,a*c);break;case"XZX":n.set(a*u,l*g,l*p,a*c);break;case"YXY":n.set(l*p,a*u,l*g,a*c);break;case"ZYZ":n.set(l*g,l*p,a*u,a*c);break;default:Je("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+s)}}function lh(n){switch(n.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function Jf(n,e){if(e.constructor===Float32Array)return n;let t=lh(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(n/t,-1)}function Kf(n,e){if(e.constructor===Float32Array)return n;let t=lh(e);if(t===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(n*t)}var wl={DEG2RAD:Uo,RAD2DEG:zo,generateUUID:br,clamp:ht,euclideanModulo:$f,mapLinear:eb,inverseLerp:tb,lerp:Va,damp:nb,pingpong:ib,smoothstep:sb,smootherstep:rb,randInt:ob,randFloat:ab,randFloatSpread:lb,seededRandom:cb,degToRad:ub,radToDeg:hb,isPowerOfTwo:db,ceilPowerOfTwo:fb,floorPowerOfTwo:Zf,setQuaternionFromProperEuler:pb,normalize:Kf,denormalize:Jf},Xe=class{static{this.prototype.isVector2=!0}constructor(e=0,t=0){this.x=e,this.y=t}get width(){return this.x}set width(e){this.x=e}get height(){return this.y}set height(e){this.y=e}set(e,t){return this.x=e,this.y=t,this}setScalar(e){return this.x=e,this.y=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;default:throw new Error("THREE.Vector2: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y)}copy(e){return this.x=e.x,this.y=e.y,this}add(e){return this.x+=e.x,this.y+=e.y,this}addScalar(e){return this.x+=e,this.y+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this}subScalar(e){return this.x-=e,this.y-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this}multiply(e){return this.x*=e.x,this.y*=e.y,this}multiplyScalar(e){return this.x*=e,this.y*=e,this}divide(e){return this.x/=e.x,this.y/=e.y,this}divideScalar(e){return this.multiplyScalar(1/e)}applyMatrix3(e){let t=this.x,i=this.y,s=e.elements;return this.x=s[0]*t+s[3]*i+s[6],this.y=s[1]*t+s[4]*i+s[7],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this}clamp(e,t){return this.x=ht(this.x,e.x,t.x),this.y=ht(this.y,e.y,t.y),this}clampScalar(e,t){return this.x=ht(this.x,e,t),this.y=ht(this.y,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ht(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(e){return this.x*e.x+this.y*e.y}cross(e){return this.x*e.y-this.y*e.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(ht(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y;return t*t+i*i}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this}equals(e){return e.x===this.x&&e.y===this.y}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this}rotateAround(e,t){let i=Math.cos(t),s=Math.sin(t),r=this.x-e.x,o=this.y-e.y;return this.x=r*i-o*s+e.x,this.y=r*s+o*i+e.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}},zt=class{constructor(e=0,t=0,i=0,s=1){this.isQuaternion=!0,this._x=e,this._y=t,this._z=i,this._w=s}static slerpFlat(e,t,i,s,r,o,a){let l=i[s+0],c=i[s+1],u=i[s+2],f=i[s+3],d=r[o+0],p=r[o+1],g=r[o+2],v=r[o+3];if(f!==v||l!==d||c!==p||u!==g){let m=l*d+c*p+u*g+f*v;m<0&&(d=-d,p=-p,g=-g,v=-v,m=-m);let _=1-a;if(m<.9995){let x=Math.acos(m),T=Math.sin(x);_=Math.sin(_*x)/T,a=Math.sin(a*x)/T,l=l*_+d*a,c=c*_+p*a,u=u*_+g*a,f=f*_+v*a}else{l=l*_+d*a,c=c*_+p*a,u=u*_+g*a,f=f*_+v*a;let x=1/Math.sqrt(l*l+c*c+u*u+f*f);l*=x,c*=x,u*=x,f*=x}}e[t]=l,e[t+1]=c,e[t+2]=u,e[t+3]=f}static multiplyQuaternionsFlat(e,t,i,s,r,o){let a=i[s],l=i[s+1],c=i[s+2],u=i[s+3],f=r[o],d=r[o+1],p=r[o+2],g=r[o+3];return e[t]=a*g+u*f+l*p-c*d,e[t+1]=l*g+u*d+c*f-a*p,e[t+2]=c*g+u*p+a*d-l*f,e[t+3]=u*g-a*f-l*d-c*p,e}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get w(){return this._w}set w(e){this._w=e,this._onChangeCallback()}set(e,t,i,s){return this._x=e,this._y=t,this._z=i,this._w=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(e){return this._x=e.x,this._y=e.y,this._z=e.z,this._w=e.w,this._onChangeCallback(),this}setFromEuler(e,t=!0){let i=e._x,s=e._y,r=e._z,o=e._order,a=Math.cos,l=Math.sin,c=a(i/2),u=a(s/2),f=a(r/2),d=l(i/2),p=l(s/2),g=l(r/2);switch(o){case"XYZ":this._x=d*u*f+c*p*g,this._y=c*p*f-d*u*g,this._z=c*u*g+d*p*f,this._w=c*u*f-d*p*g;break;case"YXZ":this._x=d*u*f+c*p*g,this._y=c*p*f-d*u*g,this._z=c*u*g-d*p*f,this._w=c*u*f+d*p*g;break;case"ZXY":this._x=d*u*f-c*p*g,this._y=c*p*f+d*u*g,this._z=c*u*g+d*p*f,this._w=c*u*f-d*p*g;break;case"ZYX":this._x=d*u*f-c*p*g,this._y=c*p*f+d*u*g,this._z=c*u*g-d*p*f,this._w=c*u*f+d*p*g;break;case"YZX":this._x=d*u*f+c*p*g,this._y=c*p*f+d*u*g,this._z=c*u*g-d*p*f,this._w=c*u*f-d*p*g;break;case"XZY":this._x=d*u*f-c*p*g,this._y=c*p*f-d*u*g,this._z=c*u*g+d*p*f,this._w=c*u*f+d*p*g;break;default:Je("Quaternion: .setFromEuler() encountered an unknown order: "+o)}return t===!0&&this._onChangeCallback(),this}setFromAxisAngle(e,t){let i=t/2,s=Math.sin(i);return this._x=e.x*s,this._y=e.y*s,this._z=e.z*s,this._w=Math.cos(i),this._onChangeCallback(),this}setFromRotationMatrix(e){let t=e.elements,i=t[0],s=t[4],r=t[8],o=t[1],a=t[5],l=t[9],c=t[2],u=t[6],f=t[10],d=i+a+f;if(d>0){let p=.5/Math.sqrt(d+1);this._w=.25/p,this._x=(u-l)*p,this._y=(r-c)*p,this._z=(o-s)*p}else if(i>a&&i>f){let p=2*Math.sqrt(1+i-a-f);this._w=(u-l)/p,this._x=.25*p,this._y=(s+o)/p,this._z=(r+c)/p}else if(a>f){let p=2*Math.sqrt(1+a-i-f);this._w=(r-c)/p,this._x=(s+o)/p,this._y=.25*p,this._z=(l+u)/p}else{let p=2*Math.sqrt(1+f-i-a);this._w=(o-s)/p,this._x=(r+c)/p,this._y=(l+u)/p,this._z=.25*p}return this._onChangeCallback(),this}setFromUnitVectors(e,t){let i=e.dot(t)+1;return i<1e-8?(i=0,Math.abs(e.x)>Math.abs(e.z)?(this._x=-e.y,this._y=e.x,this._z=0,this._w=i):(this._x=0,this._y=-e.z,this._z=e.y,this._w=i)):(this._x=e.y*t.z-e.z*t.y,this._y=e.z*t.x-e.x*t.z,this._z=e.x*t.y-e.y*t.x,this._w=i),this.normalize()}angleTo(e){return 2*Math.acos(Math.abs(ht(this.dot(e),-1,1)))}rotateTowards(e,t){let i=this.angleTo(e);if(i===0)return this;let s=Math.min(1,t/i);return this.slerp(e,s),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(e){return this._x*e._x+this._y*e._y+this._z*e._z+this._w*e._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let e=this.length();return e===0?(this._x=0,this._y=0,this._z=0,this._w=1):(e=1/e,this._x=this._x*e,this._y=this._y*e,this._z=this._z*e,this._w=this._w*e),this._onChangeCallback(),this}multiply(e){return this.multiplyQuaternions(this,e)}premultiply(e){return this.multiplyQuaternions(e,this)}multiplyQuaternions(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=t._x,l=t._y,c=t._z,u=t._w;return this._x=i*u+o*a+s*c-r*l,this._y=s*u+o*l+r*a-i*c,this._z=r*u+o*c+i*l-s*a,this._w=o*u-i*a-s*l-r*c,this._onChangeCallback(),this}slerp(e,t){let i=e._x,s=e._y,r=e._z,o=e._w,a=this.dot(e);a<0&&(i=-i,s=-s,r=-r,o=-o,a=-a);let l=1-t;if(a<.9995){let c=Math.acos(a),u=Math.sin(c);l=Math.sin(l*c)/u,t=Math.sin(t*c)/u,this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this._onChangeCallback()}else this._x=this._x*l+i*t,this._y=this._y*l+s*t,this._z=this._z*l+r*t,this._w=this._w*l+o*t,this.normalize();return this}slerpQuaternions(e,t,i){return this.copy(e).slerp(t,i)}random(){let e=2*Math.PI*Math.random(),t=2*Math.PI*Math.random(),i=Math.random(),s=Math.sqrt(1-i),r=Math.sqrt(i);return this.set(s*Math.sin(e),s*Math.cos(e),r*Math.sin(t),r*Math.cos(t))}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._w===this._w}fromArray(e,t=0){return this._x=e[t],this._y=e[t+1],this._z=e[t+2],this._w=e[t+3],this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._w,e}fromBufferAttribute(e,t){return this._x=e.getX(t),this._y=e.getY(t),this._z=e.getZ(t),this._w=e.getW(t),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}},O=class{static{this.prototype.isVector3=!0}constructor(e=0,t=0,i=0){this.x=e,this.y=t,this.z=i}set(e,t,i){return i===void 0&&(i=this.z),this.x=e,this.y=t,this.z=i,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;default:throw new Error("THREE.Vector3: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this}multiplyVectors(e,t){return this.x=e.x*t.x,this.y=e.y*t.y,this.z=e.z*t.z,this}applyEuler(e){return this.applyQuaternion(Tg.setFromEuler(e))}applyAxisAngle(e,t){return this.applyQuaternion(Tg.setFromAxisAngle(e,t))}applyMatrix3(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[3]*i+r[6]*s,this.y=r[1]*t+r[4]*i+r[7]*s,this.z=r[2]*t+r[5]*i+r[8]*s,this}applyNormalMatrix(e){return this.applyMatrix3(e).normalize()}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=e.elements,o=1/(r[3]*t+r[7]*i+r[11]*s+r[15]);return this.x=(r[0]*t+r[4]*i+r[8]*s+r[12])*o,this.y=(r[1]*t+r[5]*i+r[9]*s+r[13])*o,this.z=(r[2]*t+r[6]*i+r[10]*s+r[14])*o,this}applyQuaternion(e){let t=this.x,i=this.y,s=this.z,r=e.x,o=e.y,a=e.z,l=e.w,c=2*(o*s-a*i),u=2*(a*t-r*s),f=2*(r*i-o*t);return this.x=t+l*c+o*f-a*u,this.y=i+l*u+a*c-r*f,this.z=s+l*f+r*u-o*c,this}project(e){return this.applyMatrix4(e.matrixWorldInverse).applyMatrix4(e.projectionMatrix)}unproject(e){return this.applyMatrix4(e.projectionMatrixInverse).applyMatrix4(e.matrixWorld)}transformDirection(e){let t=this.x,i=this.y,s=this.z,r=e.elements;return this.x=r[0]*t+r[4]*i+r[8]*s,this.y=r[1]*t+r[5]*i+r[9]*s,this.z=r[2]*t+r[6]*i+r[10]*s,this.normalize()}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this}divideScalar(e){return this.multiplyScalar(1/e)}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this}clamp(e,t){return this.x=ht(this.x,e.x,t.x),this.y=ht(this.y,e.y,t.y),this.z=ht(this.z,e.z,t.z),this}clampScalar(e,t){return this.x=ht(this.x,e,t),this.y=ht(this.y,e,t),this.z=ht(this.z,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ht(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this}cross(e){return this.crossVectors(this,e)}crossVectors(e,t){let i=e.x,s=e.y,r=e.z,o=t.x,a=t.y,l=t.z;return this.x=s*l-r*a,this.y=r*o-i*l,this.z=i*a-s*o,this}projectOnVector(e){let t=e.lengthSq();if(t===0)return this.set(0,0,0);let i=e.dot(this)/t;return this.copy(e).multiplyScalar(i)}projectOnPlane(e){return Vd.copy(this).projectOnVector(e),this.sub(Vd)}reflect(e){return this.sub(Vd.copy(e).multiplyScalar(2*this.dot(e)))}angleTo(e){let t=Math.sqrt(this.lengthSq()*e.lengthSq());if(t===0)return Math.PI/2;let i=this.dot(e)/t;return Math.acos(ht(i,-1,1))}distanceTo(e){return Math.sqrt(this.distanceToSquared(e))}distanceToSquared(e){let t=this.x-e.x,i=this.y-e.y,s=this.z-e.z;return t*t+i*i+s*s}manhattanDistanceTo(e){return Math.abs(this.x-e.x)+Math.abs(this.y-e.y)+Math.abs(this.z-e.z)}setFromSpherical(e){return this.setFromSphericalCoords(e.radius,e.phi,e.theta)}setFromSphericalCoords(e,t,i){let s=Math.sin(t)*e;return this.x=s*Math.sin(i),this.y=Math.cos(t)*e,this.z=s*Math.cos(i),this}setFromCylindrical(e){return this.setFromCylindricalCoords(e.radius,e.theta,e.y)}setFromCylindricalCoords(e,t,i){return this.x=e*Math.sin(t),this.y=i,this.z=e*Math.cos(t),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this}setFromMatrixScale(e){let t=this.setFromMatrixColumn(e,0).length(),i=this.setFromMatrixColumn(e,1).length(),s=this.setFromMatrixColumn(e,2).length();return this.x=t,this.y=i,this.z=s,this}setFromMatrixColumn(e,t){return this.fromArray(e.elements,t*4)}setFromMatrix3Column(e,t){return this.fromArray(e.elements,t*3)}setFromEuler(e){return this.x=e._x,this.y=e._y,this.z=e._z,this}setFromColor(e){return this.x=e.r,this.y=e.g,this.z=e.b,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){let e=Math.random()*Math.PI*2,t=Math.random()*2-1,i=Math.sqrt(1-t*t);return this.x=i*Math.cos(e),this.y=t,this.z=i*Math.sin(e),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}},Vd=new O,Tg=new zt,st=class{static{this.prototype.isMatrix3=!0}constructor(e,t,i,s,r,o,a,l,c){this.elements=[1,0,0,0,1,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c)}set(e,t,i,s,r,o,a,l,c){let u=this.elements;return u[0]=e,u[1]=s,u[2]=a,u[3]=t,u[4]=r,u[5]=l,u[6]=i,u[7]=o,u[8]=c,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],this}extractBasis(e,t,i){return e.setFromMatrix3Column(this,0),t.setFromMatrix3Column(this,1),i.setFromMatrix3Column(this,2),this}setFromMatrix4(e){let t=e.elements;return this.set(t[0],t[4],t[8],t[1],t[5],t[9],t[2],t[6],t[10]),this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[3],l=i[6],c=i[1],u=i[4],f=i[7],d=i[2],p=i[5],g=i[8],v=s[0],m=s[3],_=s[6],x=s[1],T=s[4],S=s[7],R=s[2],C=s[5],y=s[8];return r[0]=o*v+a*x+l*R,r[3]=o*m+a*T+l*C,r[6]=o*_+a*S+l*y,r[1]=c*v+u*x+f*R,r[4]=c*m+u*T+f*C,r[7]=c*_+u*S+f*y,r[2]=d*v+p*x+g*R,r[5]=d*m+p*T+g*C,r[8]=d*_+p*S+g*y,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[3]*=e,t[6]*=e,t[1]*=e,t[4]*=e,t[7]*=e,t[2]*=e,t[5]*=e,t[8]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8];return t*o*u-t*a*c-i*r*u+i*a*l+s*r*c-s*o*l}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],f=u*o-a*c,d=a*l-u*r,p=c*r-o*l,g=t*f+i*d+s*p;if(g===0)return this.set(0,0,0,0,0,0,0,0,0);let v=1/g;return e[0]=f*v,e[1]=(s*c-u*i)*v,e[2]=(a*i-s*o)*v,e[3]=d*v,e[4]=(u*t-s*l)*v,e[5]=(s*r-a*t)*v,e[6]=p*v,e[7]=(i*l-c*t)*v,e[8]=(o*t-i*r)*v,this}transpose(){let e,t=this.elements;return e=t[1],t[1]=t[3],t[3]=e,e=t[2],t[2]=t[6],t[6]=e,e=t[5],t[5]=t[7],t[7]=e,this}getNormalMatrix(e){return this.setFromMatrix4(e).invert().transpose()}transposeIntoArray(e){let t=this.elements;return e[0]=t[0],e[1]=t[3],e[2]=t[6],e[3]=t[1],e[4]=t[4],e[5]=t[7],e[6]=t[2],e[7]=t[5],e[8]=t[8],this}setUvTransform(e,t,i,s,r,o,a){let l=Math.cos(r),c=Math.sin(r);return this.set(i*l,i*c,-i*(l*o+c*a)+o+e,-s*c,s*l,-s*(-c*o+l*a)+a+t,0,0,1),this}scale(e,t){return za("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(Gd.makeScale(e,t)),this}rotate(e){return za("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(Gd.makeRotation(-e)),this}translate(e,t){return za("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(Gd.makeTranslation(e,t)),this}makeTranslation(e,t){return e.isVector2?this.set(1,0,e.x,0,1,e.y,0,0,1):this.set(1,0,e,0,1,t,0,0,1),this}makeRotation(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,i,t,0,0,0,1),this}makeScale(e,t){return this.set(e,0,0,0,t,0,0,0,1),this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<9;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<9;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e}clone(){return new this.constructor().fromArray(this.elements)}},Gd=new st,Eg=new st().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),Ag=new st().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function mb(){let n={enabled:!0,workingColorSpace:Ha,spaces:{},convert:function(s,r,o){return this.enabled===!1||r===o||!r||!o||(this.spaces[r].transfer===Dt&&(s.r=zs(s.r),s.g=zs(s.g),s.b=zs(s.b)),this.spaces[r].primaries!==this.spaces[o].primaries&&(s.applyMatrix3(this.spaces[r].toXYZ),s.applyMatrix3(this.spaces[o].fromXYZ)),this.spaces[o].transfer===Dt&&(s.r=Oo(s.r),s.g=Oo(s.g),s.b=Oo(s.b))),s},workingToColorSpace:function(s,r){return this.convert(s,this.workingColorSpace,r)},colorSpaceToWorking:function(s,r){return this.convert(s,r,this.workingColorSpace)},getPrimaries:function(s){return this.spaces[s].primaries},getTransfer:function(s){return s===Ys?Wa:this.spaces[s].transfer},getToneMappingMode:function(s){return this.spaces[s].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(s,r=this.workingColorSpace){return s.fromArray(this.spaces[r].luminanceCoefficients)},define:function(s){Object.assign(this.spaces,s)},_getMatrix:function(s,r,o){return s.copy(this.spaces[o].fromXYZ).multiply(this.spaces[r].toXYZ)},_getDrawingBufferColorSpace:function(s){return this.spaces[s].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(s=this.workingColorSpace){return this.spaces[s].workingColorSpaceConfig.unpackColorSpace}},e=[.64,.33,.3,.6,.15,.06],t=[.2126,.7152,.0722],i=[.3127,.329];return n.define({[Ha]:{primaries:e,whitePoint:i,transfer:Wa,toXYZ:Eg,fromXYZ:Ag,luminanceCoefficients:t,workingColorSpaceConfig:{unpackColorSpace:ui},outputColorSpaceConfig:{drawingBufferColorSpace:ui}},[ui]:{primaries:e,whitePoint:i,transfer:Dt,toXYZ:Eg,fromXYZ:Ag,luminanceCoefficients:t,outputColorSpaceConfig:{drawingBufferColorSpace:ui}}}),n}var St=mb();function zs(n){return n<.04045?n*.0773993808:Math.pow(n*.9478672986+.0521327014,2.4)}function Oo(n){return n<.0031308?n*12.92:1.055*Math.pow(n,.41666)-.055}var go,Qc=class{static getDataURL(e,t="image/png"){if(/^data:/i.test(e.src)||typeof HTMLCanvasElement>"u")return e.src;let i;if(e instanceof HTMLCanvasElement)i=e;else{go===void 0&&(go=Xa("canvas")),go.width=e.width,go.height=e.height;let s=go.getContext("2d");e instanceof ImageData?s.putImageData(e,0,0):s.drawImage(e,0,0,e.width,e.height),i=go}return i.toDataURL(t)}static sRGBToLinear(e){if(typeof HTMLImageElement<"u"&&e instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&e instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&e instanceof ImageBitmap){let t=Xa("canvas");t.width=e.width,t.height=e.height;let i=t.getContext("2d");i.drawImage(e,0,0,e.width,e.height);let s=i.getImageData(0,0,e.width,e.height),r=s.data;for(let o=0;o<r.length;o++)r[o]=zs(r[o]/255)*255;return i.putImageData(s,0,0),t}else if(e.data){let t=e.data.slice(0);for(let i=0;i<t.length;i++)t instanceof Uint8Array||t instanceof Uint8ClampedArray?t[i]=Math.floor(zs(t[i]/255)*255):t[i]=zs(t[i]);return{data:t,width:e.width,height:e.height}}else return Je("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),e}},gb=0,Vo=class{constructor(e=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:gb++}),this.uuid=br(),this.data=e,this.dataReady=!0,this.version=0}getSize(e){let t=this.data;return typeof HTMLVideoElement<"u"&&t instanceof HTMLVideoElement?e.set(t.videoWidth,t.videoHeight,0):typeof VideoFrame<"u"&&t instanceof VideoFrame?e.set(t.displayWidth,t.displayHeight,0):t!==null?e.set(t.width||0,t.height||0,t.depth||0):e.set(0,0,0),e}set needsUpdate(e){e===!0&&this.version++}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.images[this.uuid]!==void 0)return e.images[this.uuid];let i={uuid:this.uuid,url:""},s=this.data;if(s!==null){let r;if(Array.isArray(s)){r=[];for(let o=0,a=s.length;o<a;o++)s[o].isDataTexture?r.push(Hd(s[o].image)):r.push(Hd(s[o]))}else r=Hd(s);i.url=r}return t||(e.images[this.uuid]=i),i}};function Hd(n){return typeof HTMLImageElement<"u"&&n instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&n instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&n instanceof ImageBitmap?Qc.getDataURL(n):n.data?{data:Array.from(n.data),width:n.width,height:n.height,type:n.data.constructor.name}:(Je("Texture: Unable to serialize Texture."),{})}var _b=0,Wd=new O,fi=class n extends es{constructor(e=n.DEFAULT_IMAGE,t=n.DEFAULT_MAPPING,i=bs,s=bs,r=di,o=Xs,a=as,l=yi,c=n.DEFAULT_ANISOTROPY,u=Ys){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:_b++}),this.uuid=br(),this.name="",this.source=new Vo(e),this.mipmaps=[],this.mapping=t,this.channel=0,this.wrapS=i,this.wrapT=s,this.magFilter=r,this.minFilter=o,this.anisotropy=c,this.format=a,this.internalFormat=null,this.type=l,this.offset=new Xe(0,0),this.repeat=new Xe(1,1),this.center=new Xe(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new st,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=u,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(e&&e.depth&&e.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(Wd).x}get height(){return this.source.getSize(Wd).y}get depth(){return this.source.getSize(Wd).z}get image(){return this.source.data}set image(e){this.source.data=e}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(e){return this.name=e.name,this.source=e.source,this.mipmaps=e.mipmaps.slice(0),this.mapping=e.mapping,this.channel=e.channel,this.wrapS=e.wrapS,this.wrapT=e.wrapT,this.magFilter=e.magFilter,this.minFilter=e.minFilter,this.anisotropy=e.anisotropy,this.format=e.format,this.internalFormat=e.internalFormat,this.type=e.type,this.normalized=e.normalized,this.offset.copy(e.offset),this.repeat.copy(e.repeat),this.center.copy(e.center),this.rotation=e.rotation,this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrix.copy(e.matrix),this.generateMipmaps=e.generateMipmaps,this.mipmapsAutoUpdate=e.mipmapsAutoUpdate,this.premultiplyAlpha=e.premultiplyAlpha,this.flipY=e.flipY,this.unpackAlignment=e.unpackAlignment,this.colorSpace=e.colorSpace,this.renderTarget=e.renderTarget,this.isRenderTargetTexture=e.isRenderTargetTexture,this.isPMREMTexture=e.isPMREMTexture,this.isArrayTexture=e.isArrayTexture,this.userData=JSON.parse(JSON.stringify(e.userData)),this.needsUpdate=!0,this}setValues(e){for(let t in e){let i=e[t];if(i===void 0){Je(`Texture.setValues(): parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){Je(`Texture.setValues(): property '${t}' does not exist.`);continue}s&&i&&s.isVector2&&i.isVector2||s&&i&&s.isVector3&&i.isVector3||s&&i&&s.isMatrix3&&i.isMatrix3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";if(!t&&e.textures[this.uuid]!==void 0)return e.textures[this.uuid];let i={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(e).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(i.userData=this.userData),t||(e.textures[this.uuid]=i),i}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(e){if(this.mapping!==Uf)return e;if(e.applyMatrix3(this.matrix),e.x<0||e.x>1)switch(this.wrapS){case Jc:e.x=e.x-Math.floor(e.x);break;case bs:e.x=e.x<0?0:1;break;case Kc:Math.abs(Math.floor(e.x)%2)===1?e.x=Math.ceil(e.x)-e.x:e.x=e.x-Math.floor(e.x);break}if(e.y<0||e.y>1)switch(this.wrapT){case Jc:e.y=e.y-Math.floor(e.y);break;case bs:e.y=e.y<0?0:1;break;case Kc:Math.abs(Math.floor(e.y)%2)===1?e.y=Math.ceil(e.y)-e.y:e.y=e.y-Math.floor(e.y);break}return this.flipY&&(e.y=1-e.y),e}set needsUpdate(e){e===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(e){e===!0&&this.pmremVersion++}};fi.DEFAULT_IMAGE=null;fi.DEFAULT_MAPPING=Uf;fi.DEFAULT_ANISOTROPY=1;var Nt=class{static{this.prototype.isVector4=!0}constructor(e=0,t=0,i=0,s=1){this.x=e,this.y=t,this.z=i,this.w=s}get width(){return this.z}set width(e){this.z=e}get height(){return this.w}set height(e){this.w=e}set(e,t,i,s){return this.x=e,this.y=t,this.z=i,this.w=s,this}setScalar(e){return this.x=e,this.y=e,this.z=e,this.w=e,this}setX(e){return this.x=e,this}setY(e){return this.y=e,this}setZ(e){return this.z=e,this}setW(e){return this.w=e,this}setComponent(e,t){switch(e){case 0:this.x=t;break;case 1:this.y=t;break;case 2:this.z=t;break;case 3:this.w=t;break;default:throw new Error("THREE.Vector4: index is out of range: "+e)}return this}getComponent(e){switch(e){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+e)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(e){return this.x=e.x,this.y=e.y,this.z=e.z,this.w=e.w!==void 0?e.w:1,this}add(e){return this.x+=e.x,this.y+=e.y,this.z+=e.z,this.w+=e.w,this}addScalar(e){return this.x+=e,this.y+=e,this.z+=e,this.w+=e,this}addVectors(e,t){return this.x=e.x+t.x,this.y=e.y+t.y,this.z=e.z+t.z,this.w=e.w+t.w,this}addScaledVector(e,t){return this.x+=e.x*t,this.y+=e.y*t,this.z+=e.z*t,this.w+=e.w*t,this}sub(e){return this.x-=e.x,this.y-=e.y,this.z-=e.z,this.w-=e.w,this}subScalar(e){return this.x-=e,this.y-=e,this.z-=e,this.w-=e,this}subVectors(e,t){return this.x=e.x-t.x,this.y=e.y-t.y,this.z=e.z-t.z,this.w=e.w-t.w,this}multiply(e){return this.x*=e.x,this.y*=e.y,this.z*=e.z,this.w*=e.w,this}multiplyScalar(e){return this.x*=e,this.y*=e,this.z*=e,this.w*=e,this}applyMatrix4(e){let t=this.x,i=this.y,s=this.z,r=this.w,o=e.elements;return this.x=o[0]*t+o[4]*i+o[8]*s+o[12]*r,this.y=o[1]*t+o[5]*i+o[9]*s+o[13]*r,this.z=o[2]*t+o[6]*i+o[10]*s+o[14]*r,this.w=o[3]*t+o[7]*i+o[11]*s+o[15]*r,this}divide(e){return this.x/=e.x,this.y/=e.y,this.z/=e.z,this.w/=e.w,this}divideScalar(e){return this.multiplyScalar(1/e)}setAxisAngleFromQuaternion(e){this.w=2*Math.acos(e.w);let t=Math.sqrt(1-e.w*e.w);return t<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=e.x/t,this.y=e.y/t,this.z=e.z/t),this}setAxisAngleFromRotationMatrix(e){let t,i,s,r,l=e.elements,c=l[0],u=l[4],f=l[8],d=l[1],p=l[5],g=l[9],v=l[2],m=l[6],_=l[10];if(Math.abs(u-d)<.01&&Math.abs(f-v)<.01&&Math.abs(g-m)<.01){if(Math.abs(u+d)<.1&&Math.abs(f+v)<.1&&Math.abs(g+m)<.1&&Math.abs(c+p+_-3)<.1)return this.set(1,0,0,0),this;t=Math.PI;let T=(c+1)/2,S=(p+1)/2,R=(_+1)/2,C=(u+d)/4,y=(f+v)/4,M=(g+m)/4;return T>S&&T>R?T<.01?(i=0,s=.707106781,r=.707106781):(i=Math.sqrt(T),s=C/i,r=y/i):S>R?S<.01?(i=.707106781,s=0,r=.707106781):(s=Math.sqrt(S),i=C/s,r=M/s):R<.01?(i=.707106781,s=.707106781,r=0):(r=Math.sqrt(R),i=y/r,s=M/r),this.set(i,s,r,t),this}let x=Math.sqrt((m-g)*(m-g)+(f-v)*(f-v)+(d-u)*(d-u));return Math.abs(x)<.001&&(x=1),this.x=(m-g)/x,this.y=(f-v)/x,this.z=(d-u)/x,this.w=Math.acos((c+p+_-1)/2),this}setFromMatrixPosition(e){let t=e.elements;return this.x=t[12],this.y=t[13],this.z=t[14],this.w=t[15],this}min(e){return this.x=Math.min(this.x,e.x),this.y=Math.min(this.y,e.y),this.z=Math.min(this.z,e.z),this.w=Math.min(this.w,e.w),this}max(e){return this.x=Math.max(this.x,e.x),this.y=Math.max(this.y,e.y),this.z=Math.max(this.z,e.z),this.w=Math.max(this.w,e.w),this}clamp(e,t){return this.x=ht(this.x,e.x,t.x),this.y=ht(this.y,e.y,t.y),this.z=ht(this.z,e.z,t.z),this.w=ht(this.w,e.w,t.w),this}clampScalar(e,t){return this.x=ht(this.x,e,t),this.y=ht(this.y,e,t),this.z=ht(this.z,e,t),this.w=ht(this.w,e,t),this}clampLength(e,t){let i=this.length();return this.divideScalar(i||1).multiplyScalar(ht(i,e,t))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(e){return this.x*e.x+this.y*e.y+this.z*e.z+this.w*e.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(e){return this.normalize().multiplyScalar(e)}lerp(e,t){return this.x+=(e.x-this.x)*t,this.y+=(e.y-this.y)*t,this.z+=(e.z-this.z)*t,this.w+=(e.w-this.w)*t,this}lerpVectors(e,t,i){return this.x=e.x+(t.x-e.x)*i,this.y=e.y+(t.y-e.y)*i,this.z=e.z+(t.z-e.z)*i,this.w=e.w+(t.w-e.w)*i,this}equals(e){return e.x===this.x&&e.y===this.y&&e.z===this.z&&e.w===this.w}fromArray(e,t=0){return this.x=e[t],this.y=e[t+1],this.z=e[t+2],this.w=e[t+3],this}toArray(e=[],t=0){return e[t]=this.x,e[t+1]=this.y,e[t+2]=this.z,e[t+3]=this.w,e}fromBufferAttribute(e,t){return this.x=e.getX(t),this.y=e.getY(t),this.z=e.getZ(t),this.w=e.getW(t),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}},eu=class extends es{constructor(e=1,t=1,i={}){super(),i=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:di,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},i),this.isRenderTarget=!0,this.width=e,this.height=t,this.depth=i.depth,this.scissor=new Nt(0,0,e,t),this.scissorTest=!1,this.viewport=new Nt(0,0,e,t),this.textures=[];let s=i.count;for(let r=0;r<s;r++)this.textures[r]=new fi({width:e,height:t,depth:i.depth}),this.textures[r].isRenderTargetTexture=!0,this.textures[r].renderTarget=this;this._setTextureOptions(i),this.depthBuffer=i.depthBuffer,this.stencilBuffer=i.stencilBuffer,this.resolveColorBuffer=i.resolveColorBuffer,this.resolveDepthBuffer=i.resolveDepthBuffer,this.resolveStencilBuffer=i.resolveStencilBuffer,this.storeMultisampledColorBuffer=i.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=i.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=i.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=i.depthTexture,this.samples=i.samples,this.multiview=i.multiview,this.useArrayDepthTexture=i.useArrayDepthTexture}_setTextureOptions(e={}){let t={minFilter:di,generateMipmaps:!1,flipY:!1,internalFormat:null};e.mapping!==void 0&&(t.mapping=e.mapping),e.wrapS!==void 0&&(t.wrapS=e.wrapS),e.wrapT!==void 0&&(t.wrapT=e.wrapT),e.wrapR!==void 0&&(t.wrapR=e.wrapR),e.magFilter!==void 0&&(t.magFilter=e.magFilter),e.minFilter!==void 0&&(t.minFilter=e.minFilter),e.format!==void 0&&(t.format=e.format),e.type!==void 0&&(t.type=e.type),e.anisotropy!==void 0&&(t.anisotropy=e.anisotropy),e.colorSpace!==void 0&&(t.colorSpace=e.colorSpace),e.flipY!==void 0&&(t.flipY=e.flipY),e.generateMipmaps!==void 0&&(t.generateMipmaps=e.generateMipmaps),e.mipmapsAutoUpdate!==void 0&&(t.mipmapsAutoUpdate=e.mipmapsAutoUpdate),e.internalFormat!==void 0&&(t.internalFormat=e.internalFormat);for(let i=0;i<this.textures.length;i++)this.textures[i].setValues(t)}get texture(){return this.textures[0]}set texture(e){this.textures[0]=e}set depthTexture(e){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),e!==null&&e.renderTarget===null&&(e.renderTarget=this),this._depthTexture=e}get depthTexture(){return this._depthTexture}setSize(e,t,i=1){if(this.width!==e||this.height!==t||this.depth!==i){this.width=e,this.height=t,this.depth=i;for(let s=0,r=this.textures.length;s<r;s++)this.textures[s].image.width=e,this.textures[s].image.height=t,this.textures[s].image.depth=i,this.textures[s].isData3DTexture!==!0&&(this.textures[s].isArrayTexture=this.textures[s].image.depth>1);this.dispose()}this.viewport.set(0,0,e,t),this.scissor.set(0,0,e,t)}clone(){return new this.constructor().copy(this)}copy(e){this.width=e.width,this.height=e.height,this.depth=e.depth,this.scissor.copy(e.scissor),this.scissorTest=e.scissorTest,this.viewport.copy(e.viewport),this.textures.length=0;for(let t=0,i=e.textures.length;t<i;t++){this.textures[t]=e.textures[t].clone(),this.textures[t].isRenderTargetTexture=!0,this.textures[t].renderTarget=this;let s=Object.assign({},e.textures[t].image);this.textures[t].source=new Vo(s)}if(this.depthBuffer=e.depthBuffer,this.stencilBuffer=e.stencilBuffer,this.resolveColorBuffer=e.resolveColorBuffer,this.resolveDepthBuffer=e.resolveDepthBuffer,this.resolveStencilBuffer=e.resolveStencilBuffer,this.storeMultisampledColorBuffer=e.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=e.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=e.storeMultisampledStencilBuffer,e.depthTexture!==null)if(e.depthTexture.renderTarget===e){let t=e.depthTexture.clone();t.renderTarget=null,this.depthTexture=t}else this.depthTexture=e.depthTexture;else this.depthTexture=null;return this.samples=e.samples,this.multiview=e.multiview,this.useArrayDepthTexture=e.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}},Pi=class extends eu{constructor(e=1,t=1,i={}){super(e,t,i),this.isWebGLRenderTarget=!0}},Ya=class extends fi{constructor(e=null,t=1,i=1,s=1){super(null),this.isDataArrayTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=qn,this.minFilter=qn,this.wrapR=bs,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}addLayerUpdate(e){this.layerUpdates.add(e)}clearLayerUpdates(){this.layerUpdates.clear()}};var tu=class extends fi{constructor(e=null,t=1,i=1,s=1){super(null),this.isData3DTexture=!0,this.image={data:e,width:t,height:i,depth:s},this.magFilter=qn,this.minFilter=qn,this.wrapR=bs,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(e){return super.copy(e),this.wrapR=e.wrapR,this}};var Et=class n{static{this.prototype.isMatrix4=!0}constructor(e,t,i,s,r,o,a,l,c,u,f,d,p,g,v,m){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],e!==void 0&&this.set(e,t,i,s,r,o,a,l,c,u,f,d,p,g,v,m)}set(e,t,i,s,r,o,a,l,c,u,f,d,p,g,v,m){let _=this.elements;return _[0]=e,_[4]=t,_[8]=i,_[12]=s,_[1]=r,_[5]=o,_[9]=a,_[13]=l,_[2]=c,_[6]=u,_[10]=f,_[14]=d,_[3]=p,_[7]=g,_[11]=v,_[15]=m,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new n().fromArray(this.elements)}copy(e){let t=this.elements,i=e.elements;return t[0]=i[0],t[1]=i[1],t[2]=i[2],t[3]=i[3],t[4]=i[4],t[5]=i[5],t[6]=i[6],t[7]=i[7],t[8]=i[8],t[9]=i[9],t[10]=i[10],t[11]=i[11],t[12]=i[12],t[13]=i[13],t[14]=i[14],t[15]=i[15],this}copyPosition(e){let t=this.elements,i=e.elements;return t[12]=i[12],t[13]=i[13],t[14]=i[14],this}setFromMatrix3(e){let t=e.elements;return this.set(t[0],t[3],t[6],0,t[1],t[4],t[7],0,t[2],t[5],t[8],0,0,0,0,1),this}extractBasis(e,t,i){return this.determinantAffine()===0?(e.set(1,0,0),t.set(0,1,0),i.set(0,0,1),this):(e.setFromMatrixColumn(this,0),t.setFromMatrixColumn(this,1),i.setFromMatrixColumn(this,2),this)}makeBasis(e,t,i){return this.set(e.x,t.x,i.x,0,e.y,t.y,i.y,0,e.z,t.z,i.z,0,0,0,0,1),this}extractRotation(e){if(e.determinantAffine()===0)return this.identity();let t=this.elements,i=e.elements,s=1/_o.setFromMatrixColumn(e,0).length(),r=1/_o.setFromMatrixColumn(e,1).length(),o=1/_o.setFromMatrixColumn(e,2).length();return t[0]=i[0]*s,t[1]=i[1]*s,t[2]=i[2]*s,t[3]=0,t[4]=i[4]*r,t[5]=i[5]*r,t[6]=i[6]*r,t[7]=0,t[8]=i[8]*o,t[9]=i[9]*o,t[10]=i[10]*o,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromEuler(e){let t=this.elements,i=e.x,s=e.y,r=e.z,o=Math.cos(i),a=Math.sin(i),l=Math.cos(s),c=Math.sin(s),u=Math.cos(r),f=Math.sin(r);if(e.order==="XYZ"){let d=o*u,p=o*f,g=a*u,v=a*f;t[0]=l*u,t[4]=-l*f,t[8]=c,t[1]=p+g*c,t[5]=d-v*c,t[9]=-a*l,t[2]=v-d*c,t[6]=g+p*c,t[10]=o*l}else if(e.order==="YXZ"){let d=l*u,p=l*f,g=c*u,v=c*f;t[0]=d+v*a,t[4]=g*a-p,t[8]=o*c,t[1]=o*f,t[5]=o*u,t[9]=-a,t[2]=p*a-g,t[6]=v+d*a,t[10]=o*l}else if(e.order==="ZXY"){let d=l*u,p=l*f,g=c*u,v=c*f;t[0]=d-v*a,t[4]=-o*f,t[8]=g+p*a,t[1]=p+g*a,t[5]=o*u,t[9]=v-d*a,t[2]=-o*c,t[6]=a,t[10]=o*l}else if(e.order==="ZYX"){let d=o*u,p=o*f,g=a*u,v=a*f;t[0]=l*u,t[4]=g*c-p,t[8]=d*c+v,t[1]=l*f,t[5]=v*c+d,t[9]=p*c-g,t[2]=-c,t[6]=a*l,t[10]=o*l}else if(e.order==="YZX"){let d=o*l,p=o*c,g=a*l,v=a*c;t[0]=l*u,t[4]=v-d*f,t[8]=g*f+p,t[1]=f,t[5]=o*u,t[9]=-a*u,t[2]=-c*u,t[6]=p*f+g,t[10]=d-v*f}else if(e.order==="XZY"){let d=o*l,p=o*c,g=a*l,v=a*c;t[0]=l*u,t[4]=-f,t[8]=c*u,t[1]=d*f+v,t[5]=o*u,t[9]=p*f-g,t[2]=g*f-p,t[6]=a*u,t[10]=v*f+d}return t[3]=0,t[7]=0,t[11]=0,t[12]=0,t[13]=0,t[14]=0,t[15]=1,this}makeRotationFromQuaternion(e){return this.compose(vb,e,xb)}lookAt(e,t,i){let s=this.elements;return Ei.subVectors(e,t),Ei.lengthSq()===0&&(Ei.z=1),Ei.normalize(),rr.crossVectors(i,Ei),rr.lengthSq()===0&&(Math.abs(i.z)===1?Ei.x+=1e-4:Ei.z+=1e-4,Ei.normalize(),rr.crossVectors(i,Ei)),rr.normalize(),uc.crossVectors(Ei,rr),s[0]=rr.x,s[4]=uc.x,s[8]=Ei.x,s[1]=rr.y,s[5]=uc.y,s[9]=Ei.y,s[2]=rr.z,s[6]=uc.z,s[10]=Ei.z,this}multiply(e){return this.multiplyMatrices(this,e)}premultiply(e){return this.multiplyMatrices(e,this)}multiplyMatrices(e,t){let i=e.elements,s=t.elements,r=this.elements,o=i[0],a=i[4],l=i[8],c=i[12],u=i[1],f=i[5],d=i[9],p=i[13],g=i[2],v=i[6],m=i[10],_=i[14],x=i[3],T=i[7],S=i[11],R=i[15],C=s[0],y=s[4],M=s[8],N=s[12],P=s[1],D=s[5],z=s[9],G=s[13],U=s[2],W=s[6],$=s[10],H=s[14],le=s[3],Y=s[7],Q=s[11],ie=s[15];return r[0]=o*C+a*P+l*U+c*le,r[4]=o*y+a*D+l*W+c*Y,r[8]=o*M+a*z+l*$+c*Q,r[12]=o*N+a*G+l*H+c*ie,r[1]=u*C+f*P+d*U+p*le,r[5]=u*y+f*D+d*W+p*Y,r[9]=u*M+f*z+d*$+p*Q,r[13]=u*N+f*G+d*H+p*ie,r[2]=g*C+v*P+m*U+_*le,r[6]=g*y+v*D+m*W+_*Y,r[10]=g*M+v*z+m*$+_*Q,r[14]=g*N+v*G+m*H+_*ie,r[3]=x*C+T*P+S*U+R*le,r[7]=x*y+T*D+S*W+R*Y,r[11]=x*M+T*z+S*$+R*Q,r[15]=x*N+T*G+S*H+R*ie,this}multiplyScalar(e){let t=this.elements;return t[0]*=e,t[4]*=e,t[8]*=e,t[12]*=e,t[1]*=e,t[5]*=e,t[9]*=e,t[13]*=e,t[2]*=e,t[6]*=e,t[10]*=e,t[14]*=e,t[3]*=e,t[7]*=e,t[11]*=e,t[15]*=e,this}determinant(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[12],o=e[1],a=e[5],l=e[9],c=e[13],u=e[2],f=e[6],d=e[10],p=e[14],g=e[3],v=e[7],m=e[11],_=e[15],x=l*p-c*d,T=a*p-c*f,S=a*d-l*f,R=o*p-c*u,C=o*d-l*u,y=o*f-a*u;return t*(v*x-m*T+_*S)-i*(g*x-m*R+_*C)+s*(g*T-v*R+_*y)-r*(g*S-v*C+m*y)}determinantAffine(){let e=this.elements,t=e[0],i=e[4],s=e[8],r=e[1],o=e[5],a=e[9],l=e[2],c=e[6],u=e[10];return t*(o*u-a*c)-i*(r*u-a*l)+s*(r*c-o*l)}transpose(){let e=this.elements,t;return t=e[1],e[1]=e[4],e[4]=t,t=e[2],e[2]=e[8],e[8]=t,t=e[6],e[6]=e[9],e[9]=t,t=e[3],e[3]=e[12],e[12]=t,t=e[7],e[7]=e[13],e[13]=t,t=e[11],e[11]=e[14],e[14]=t,this}setPosition(e,t,i){let s=this.elements;return e.isVector3?(s[12]=e.x,s[13]=e.y,s[14]=e.z):(s[12]=e,s[13]=t,s[14]=i),this}invert(){let e=this.elements,t=e[0],i=e[1],s=e[2],r=e[3],o=e[4],a=e[5],l=e[6],c=e[7],u=e[8],f=e[9],d=e[10],p=e[11],g=e[12],v=e[13],m=e[14],_=e[15],x=t*a-i*o,T=t*l-s*o,S=t*c-r*o,R=i*l-s*a,C=i*c-r*a,y=s*c-r*l,M=u*v-f*g,N=u*m-d*g,P=u*_-p*g,D=f*m-d*v,z=f*_-p*v,G=d*_-p*m,U=x*G-T*z+S*D+R*P-C*N+y*M;if(U===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);let W=1/U;return e[0]=(a*G-l*z+c*D)*W,e[1]=(s*z-i*G-r*D)*W,e[2]=(v*y-m*C+_*R)*W,e[3]=(d*C-f*y-p*R)*W,e[4]=(l*P-o*G-c*N)*W,e[5]=(t*G-s*P+r*N)*W,e[6]=(m*S-g*y-_*T)*W,e[7]=(u*y-d*S+p*T)*W,e[8]=(o*z-a*P+c*M)*W,e[9]=(i*P-t*z-r*M)*W,e[10]=(g*C-v*S+_*x)*W,e[11]=(f*S-u*C-p*x)*W,e[12]=(a*N-o*D-l*M)*W,e[13]=(t*D-i*N+s*M)*W,e[14]=(v*T-g*R-m*x)*W,e[15]=(u*R-f*T+d*x)*W,this}scale(e){let t=this.elements,i=e.x,s=e.y,r=e.z;return t[0]*=i,t[4]*=s,t[8]*=r,t[1]*=i,t[5]*=s,t[9]*=r,t[2]*=i,t[6]*=s,t[10]*=r,t[3]*=i,t[7]*=s,t[11]*=r,this}getMaxScaleOnAxis(){let e=this.elements,t=e[0]*e[0]+e[1]*e[1]+e[2]*e[2],i=e[4]*e[4]+e[5]*e[5]+e[6]*e[6],s=e[8]*e[8]+e[9]*e[9]+e[10]*e[10];return Math.sqrt(Math.max(t,i,s))}makeTranslation(e,t,i){return e.isVector3?this.set(1,0,0,e.x,0,1,0,e.y,0,0,1,e.z,0,0,0,1):this.set(1,0,0,e,0,1,0,t,0,0,1,i,0,0,0,1),this}makeRotationX(e){let t=Math.cos(e),i=Math.sin(e);return this.set(1,0,0,0,0,t,-i,0,0,i,t,0,0,0,0,1),this}makeRotationY(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,0,i,0,0,1,0,0,-i,0,t,0,0,0,0,1),this}makeRotationZ(e){let t=Math.cos(e),i=Math.sin(e);return this.set(t,-i,0,0,i,t,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(e,t){let i=Math.cos(t),s=Math.sin(t),r=1-i,o=e.x,a=e.y,l=e.z,c=r*o,u=r*a;return this.set(c*o+i,c*a-s*l,c*l+s*a,0,c*a+s*l,u*a+i,u*l-s*o,0,c*l-s*a,u*l+s*o,r*l*l+i,0,0,0,0,1),this}makeScale(e,t,i){return this.set(e,0,0,0,0,t,0,0,0,0,i,0,0,0,0,1),this}makeShear(e,t,i,s,r,o){return this.set(1,i,r,0,e,1,o,0,t,s,1,0,0,0,0,1),this}compose(e,t,i){let s=this.elements,r=t._x,o=t._y,a=t._z,l=t._w,c=r+r,u=o+o,f=a+a,d=r*c,p=r*u,g=r*f,v=o*u,m=o*f,_=a*f,x=l*c,T=l*u,S=l*f,R=i.x,C=i.y,y=i.z;return s[0]=(1-(v+_))*R,s[1]=(p+S)*R,s[2]=(g-T)*R,s[3]=0,s[4]=(p-S)*C,s[5]=(1-(d+_))*C,s[6]=(m+x)*C,s[7]=0,s[8]=(g+T)*y,s[9]=(m-x)*y,s[10]=(1-(d+v))*y,s[11]=0,s[12]=e.x,s[13]=e.y,s[14]=e.z,s[15]=1,this}decompose(e,t,i){let s=this.elements;e.x=s[12],e.y=s[13],e.z=s[14];let r=this.determinantAffine();if(r===0)return i.set(1,1,1),t.identity(),this;let o=_o.set(s[0],s[1],s[2]).length(),a=_o.set(s[4],s[5],s[6]).length(),l=_o.set(s[8],s[9],s[10]).length();r<0&&(o=-o),Ji.copy(this);let c=1/o,u=1/a,f=1/l;return Ji.elements[0]*=c,Ji.elements[1]*=c,Ji.elements[2]*=c,Ji.elements[4]*=u,Ji.elements[5]*=u,Ji.elements[6]*=u,Ji.elements[8]*=f,Ji.elements[9]*=f,Ji.elements[10]*=f,t.setFromRotationMatrix(Ji),i.x=o,i.y=a,i.z=l,this}makePerspective(e,t,i,s,r,o,a=zi,l=!1){let c=this.elements,u=2*r/(t-e),f=2*r/(i-s),d=(t+e)/(t-e),p=(i+s)/(i-s),g,v;if(l)g=r/(o-r),v=o*r/(o-r);else if(a===zi)g=-(o+r)/(o-r),v=-2*o*r/(o-r);else if(a===ko)g=-o/(o-r),v=-o*r/(o-r);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=d,c[12]=0,c[1]=0,c[5]=f,c[9]=p,c[13]=0,c[2]=0,c[6]=0,c[10]=g,c[14]=v,c[3]=0,c[7]=0,c[11]=-1,c[15]=0,this}makeOrthographic(e,t,i,s,r,o,a=zi,l=!1){let c=this.elements,u=2/(t-e),f=2/(i-s),d=-(t+e)/(t-e),p=-(i+s)/(i-s),g,v;if(l)g=1/(o-r),v=o/(o-r);else if(a===zi)g=-2/(o-r),v=-(o+r)/(o-r);else if(a===ko)g=-1/(o-r),v=-r/(o-r);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=0,c[12]=d,c[1]=0,c[5]=f,c[9]=0,c[13]=p,c[2]=0,c[6]=0,c[10]=g,c[14]=v,c[3]=0,c[7]=0,c[11]=0,c[15]=1,this}equals(e){let t=this.elements,i=e.elements;for(let s=0;s<16;s++)if(t[s]!==i[s])return!1;return!0}fromArray(e,t=0){for(let i=0;i<16;i++)this.elements[i]=e[i+t];return this}toArray(e=[],t=0){let i=this.elements;return e[t]=i[0],e[t+1]=i[1],e[t+2]=i[2],e[t+3]=i[3],e[t+4]=i[4],e[t+5]=i[5],e[t+6]=i[6],e[t+7]=i[7],e[t+8]=i[8],e[t+9]=i[9],e[t+10]=i[10],e[t+11]=i[11],e[t+12]=i[12],e[t+13]=i[13],e[t+14]=i[14],e[t+15]=i[15],e}},_o=new O,Ji=new Et,vb=new O(0,0,0),xb=new O(1,1,1),rr=new O,uc=new O,Ei=new O,Cg=new Et,Rg=new zt,ts=class n{constructor(e=0,t=0,i=0,s=n.DEFAULT_ORDER){this.isEuler=!0,this._x=e,this._y=t,this._z=i,this._order=s}get x(){return this._x}set x(e){this._x=e,this._onChangeCallback()}get y(){return this._y}set y(e){this._y=e,this._onChangeCallback()}get z(){return this._z}set z(e){this._z=e,this._onChangeCallback()}get order(){return this._order}set order(e){this._order=e,this._onChangeCallback()}set(e,t,i,s=this._order){return this._x=e,this._y=t,this._z=i,this._order=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(e){return this._x=e._x,this._y=e._y,this._z=e._z,this._order=e._order,this._onChangeCallback(),this}setFromRotationMatrix(e,t=this._order,i=!0){let s=e.elements,r=s[0],o=s[4],a=s[8],l=s[1],c=s[5],u=s[9],f=s[2],d=s[6],p=s[10];switch(t){case"XYZ":this._y=Math.asin(ht(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-u,p),this._z=Math.atan2(-o,r)):(this._x=Math.atan2(d,c),this._z=0);break;case"YXZ":this._x=Math.asin(-ht(u,-1,1)),Math.abs(u)<.9999999?(this._y=Math.atan2(a,p),this._z=Math.atan2(l,c)):(this._y=Math.atan2(-f,r),this._z=0);break;case"ZXY":this._x=Math.asin(ht(d,-1,1)),Math.abs(d)<.9999999?(this._y=Math.atan2(-f,p),this._z=Math.atan2(-o,c)):(this._y=0,this._z=Math.atan2(l,r));break;case"ZYX":this._y=Math.asin(-ht(f,-1,1)),Math.abs(f)<.9999999?(this._x=Math.atan2(d,p),this._z=Math.atan2(l,r)):(this._x=0,this._z=Math.atan2(-o,c));break;case"YZX":this._z=Math.asin(ht(l,-1,1)),Math.abs(l)<.9999999?(this._x=Math.atan2(-u,c),this._y=Math.atan2(-f,r)):(this._x=0,this._y=Math.atan2(a,p));break;case"XZY":this._z=Math.asin(-ht(o,-1,1)),Math.abs(o)<.9999999?(this._x=Math.atan2(d,c),this._y=Math.atan2(a,r)):(this._x=Math.atan2(-u,p),this._y=0);break;default:Je("Euler: .setFromRotationMatrix() encountered an unknown order: "+t)}return this._order=t,i===!0&&this._onChangeCallback(),this}setFromQuaternion(e,t,i){return Cg.makeRotationFromQuaternion(e),this.setFromRotationMatrix(Cg,t,i)}setFromVector3(e,t=this._order){return this.set(e.x,e.y,e.z,t)}reorder(e){return Rg.setFromEuler(this),this.setFromQuaternion(Rg,e)}equals(e){return e._x===this._x&&e._y===this._y&&e._z===this._z&&e._order===this._order}fromArray(e){return this._x=e[0],this._y=e[1],this._z=e[2],e[3]!==void 0&&(this._order=e[3]),this._onChangeCallback(),this}toArray(e=[],t=0){return e[t]=this._x,e[t+1]=this._y,e[t+2]=this._z,e[t+3]=this._order,e}_onChange(e){return this._onChangeCallback=e,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}};ts.DEFAULT_ORDER="XYZ";var Go=class{constructor(){this.mask=1}set(e){this.mask=(1<<e|0)>>>0}enable(e){this.mask|=1<<e|0}enableAll(){this.mask=-1}toggle(e){this.mask^=1<<e|0}disable(e){this.mask&=~(1<<e|0)}disableAll(){this.mask=0}test(e){return(this.mask&e.mask)!==0}isEnabled(e){return(this.mask&(1<<e|0))!==0}},yb=0,Pg=new O,vo=new zt,Us=new Et,hc=new O,La=new O,bb=new O,Sb=new zt,Ig=new O(1,0,0),Lg=new O(0,1,0),Dg=new O(0,0,1),Ng={type:"added"},Mb={type:"removed"},xo={type:"childadded",child:null},Xd={type:"childremoved",child:null},ln=class n extends es{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:yb++}),this.uuid=br(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=n.DEFAULT_UP.clone();let e=new O,t=new ts,i=new zt,s=new O(1,1,1);function r(){i.setFromEuler(t,!1)}function o(){t.setFromQuaternion(i,void 0,!1)}t._onChange(r),i._onChange(o),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:e},rotation:{configurable:!0,enumerable:!0,value:t},quaternion:{configurable:!0,enumerable:!0,value:i},scale:{configurable:!0,enumerable:!0,value:s},modelViewMatrix:{value:new Et},normalMatrix:{value:new st}}),this.matrix=new Et,this.matrixWorld=new Et,this.matrixAutoUpdate=n.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=n.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new Go,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(e){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(e),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(e){return this.quaternion.premultiply(e),this}setRotationFromAxisAngle(e,t){this.quaternion.setFromAxisAngle(e,t)}setRotationFromEuler(e){this.quaternion.setFromEuler(e,!0)}setRotationFromMatrix(e){this.quaternion.setFromRotationMatrix(e)}setRotationFromQuaternion(e){this.quaternion.copy(e)}rotateOnAxis(e,t){return vo.setFromAxisAngle(e,t),this.quaternion.multiply(vo),this}rotateOnWorldAxis(e,t){return vo.setFromAxisAngle(e,t),this.quaternion.premultiply(vo),this}rotateX(e){return this.rotateOnAxis(Ig,e)}rotateY(e){return this.rotateOnAxis(Lg,e)}rotateZ(e){return this.rotateOnAxis(Dg,e)}translateOnAxis(e,t){return Pg.copy(e).applyQuaternion(this.quaternion),this.position.add(Pg.multiplyScalar(t)),this}translateX(e){return this.translateOnAxis(Ig,e)}translateY(e){return this.translateOnAxis(Lg,e)}translateZ(e){return this.translateOnAxis(Dg,e)}localToWorld(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(this.matrixWorld)}worldToLocal(e){return this.updateWorldMatrix(!0,!1),e.applyMatrix4(Us.copy(this.matrixWorld).invert())}lookAt(e,t,i){e.isVector3?hc.copy(e):hc.set(e,t,i);let s=this.parent;this.updateWorldMatrix(!0,!1),La.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?Us.lookAt(La,hc,this.up):Us.lookAt(hc,La,this.up),this.quaternion.setFromRotationMatrix(Us),s&&(Us.extractRotation(s.matrixWorld),vo.setFromRotationMatrix(Us),this.quaternion.premultiply(vo.invert()))}add(e){if(arguments.length>1){for(let t=0;t<arguments.length;t++)this.add(arguments[t]);return this}return e===this?(Qe("Object3D.add: object can't be added as a child of itself.",e),this):(e&&e.isObject3D?(e.removeFromParent(),e.parent=this,this.children.push(e),e.dispatchEvent(Ng),xo.child=e,this.dispatchEvent(xo),xo.child=null):Qe("Object3D.add: object not an instance of THREE.Object3D.",e),this)}remove(e){if(arguments.length>1){for(let i=0;i<arguments.length;i++)this.remove(arguments[i]);return this}let t=this.children.indexOf(e);return t!==-1&&(e.parent=null,this.children.splice(t,1),e.dispatchEvent(Mb),Xd.child=e,this.dispatchEvent(Xd),Xd.child=null),this}removeFromParent(){let e=this.parent;return e!==null&&e.remove(this),this}clear(){return this.remove(...this.children)}attach(e){return this.updateWorldMatrix(!0,!1),Us.copy(this.matrixWorld).invert(),e.parent!==null&&(e.parent.updateWorldMatrix(!0,!1),Us.multiply(e.parent.matrixWorld)),e.applyMatrix4(Us),e.removeFromParent(),e.parent=this,this.children.push(e),e.updateWorldMatrix(!1,!0),e.dispatchEvent(Ng),xo.child=e,this.dispatchEvent(xo),xo.child=null,this}getObjectById(e){return this.getObjectByProperty("id",e)}getObjectByName(e){return this.getObjectByProperty("name",e)}getObjectByProperty(e,t){if(this[e]===t)return this;for(let i=0,s=this.children.length;i<s;i++){let o=this.children[i].getObjectByProperty(e,t);if(o!==void 0)return o}}getObjectsByProperty(e,t,i=[]){this[e]===t&&i.push(this);let s=this.children;for(let r=0,o=s.length;r<o;r++)s[r].getObjectsByProperty(e,t,i);return i}getWorldPosition(e){return this.updateWorldMatrix(!0,!1),e.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(La,e,bb),e}getWorldScale(e){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(La,Sb,e),e}getWorldDirection(e){this.updateWorldMatrix(!0,!1);let t=this.matrixWorld.elements;return e.set(t[8],t[9],t[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(e){e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverse(e)}traverseVisible(e){if(this.visible===!1)return;e(this);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].traverseVisible(e)}traverseAncestors(e){let t=this.parent;t!==null&&(e(t),t.traverseAncestors(e))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);let e=this.pivot;if(e!==null){let t=e.x,i=e.y,s=e.z,r=this.matrix.elements;r[12]+=t-r[0]*t-r[4]*i-r[8]*s,r[13]+=i-r[1]*t-r[5]*i-r[9]*s,r[14]+=s-r[2]*t-r[6]*i-r[10]*s}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(e){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||e)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,e=!0);let t=this.children;for(let i=0,s=t.length;i<s;i++)t[i].updateMatrixWorld(e)}updateWorldMatrix(e,t,i=!1){let s=this.parent;if(e===!0&&s!==null&&s.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||i)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,i=!0),t===!0){let r=this.children;for(let o=0,a=r.length;o<a;o++)r[o].updateWorldMatrix(!1,!0,i)}}toJSON(e){let t=e===void 0||typeof e=="string",i={};t&&(e={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},i.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});let s={};s.uuid=this.uuid,s.type=this.type,s.name=this.name,s.castShadow=this.castShadow,s.receiveShadow=this.receiveShadow,s.visible=this.visible,s.frustumCulled=this.frustumCulled,s.renderOrder=this.renderOrder,s.static=this.static,s.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(s.userData=this.userData),s.layers=this.layers.mask,s.matrix=this.matrix.toArray(),s.up=this.up.toArray(),this.pivot!==null&&(s.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(s.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(s.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(s.type="InstancedMesh",s.count=this.count,s.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(s.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(s.type="BatchedMesh",s.perObjectFrustumCulled=this.perObjectFrustumCulled,s.sortObjects=this.sortObjects,s.drawRanges=this._drawRanges,s.reservedRanges=this._reservedRanges,s.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),s.instanceInfo=this._instanceInfo.map(a=>({...a})),s.availableInstanceIds=this._availableInstanceIds.slice(),s.availableGeometryIds=this._availableGeometryIds.slice(),s.nextIndexStart=this._nextIndexStart,s.nextVertexStart=this._nextVertexStart,s.geometryCount=this._geometryCount,s.maxInstanceCount=this._maxInstanceCount,s.maxVertexCount=this._maxVertexCount,s.maxIndexCount=this._maxIndexCount,s.geometryInitialized=this._geometryInitialized,s.matricesTexture=this._matricesTexture.toJSON(e),s.indirectTexture=this._indirectTexture.toJSON(e),this._colorsTexture!==null&&(s.colorsTexture=this._colorsTexture.toJSON(e)),this.boundingSphere!==null&&(s.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(s.boundingBox=this.boundingBox.toJSON()));function r(a,l){return a[l.uuid]===void 0&&(a[l.uuid]=l.toJSON(e)),l.uuid}if(this.isScene)this.background&&(this.background.isColor?s.background=this.background.toJSON():this.background.isTexture&&(s.background=this.background.toJSON(e).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(s.environment=this.environment.toJSON(e).uuid);else if(this.isMesh||this.isLine||this.isPoints){s.geometry=r(e.geometries,this.geometry);let a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){let l=a.shapes;if(Array.isArray(l))for(let c=0,u=l.length;c<u;c++){let f=l[c];r(e.shapes,f)}else r(e.shapes,l)}}if(this.isSkinnedMesh&&(s.bindMode=this.bindMode,s.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(r(e.skeletons,this.skeleton),s.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){let a=[];for(let l=0,c=this.material.length;l<c;l++)a.push(r(e.materials,this.material[l]));s.material=a}else s.material=r(e.materials,this.material);if(this.children.length>0){s.children=[];for(let a=0;a<this.children.length;a++)s.children.push(this.children[a].toJSON(e).object)}if(this.animations.length>0){s.animations=[];for(let a=0;a<this.animations.length;a++){let l=this.animations[a];s.animations.push(r(e.animations,l))}}if(t){let a=o(e.geometries),l=o(e.materials),c=o(e.textures),u=o(e.images),f=o(e.shapes),d=o(e.skeletons),p=o(e.animations),g=o(e.nodes);a.length>0&&(i.geometries=a),l.length>0&&(i.materials=l),c.length>0&&(i.textures=c),u.length>0&&(i.images=u),f.length>0&&(i.shapes=f),d.length>0&&(i.skeletons=d),p.length>0&&(i.animations=p),g.length>0&&(i.nodes=g)}return i.object=s,i;function o(a){let l=[];for(let c in a){let u=a[c];delete u.metadata,l.push(u)}return l}}clone(e){return new this.constructor().copy(this,e)}copy(e,t=!0){if(this.name=e.name,this.up.copy(e.up),this.position.copy(e.position),this.rotation.order=e.rotation.order,this.quaternion.copy(e.quaternion),this.scale.copy(e.scale),this.pivot=e.pivot!==null?e.pivot.clone():null,this.matrix.copy(e.matrix),this.matrixWorld.copy(e.matrixWorld),this.matrixAutoUpdate=e.matrixAutoUpdate,this.matrixWorldAutoUpdate=e.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=e.matrixWorldNeedsUpdate,this.layers.mask=e.layers.mask,this.visible=e.visible,this.castShadow=e.castShadow,this.receiveShadow=e.receiveShadow,this.frustumCulled=e.frustumCulled,this.renderOrder=e.renderOrder,this.static=e.static,this.animations=e.animations.slice(),this.userData=JSON.parse(JSON.stringify(e.userData)),t===!0)for(let i=0;i<e.children.length;i++){let s=e.children[i];this.add(s.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}};ln.DEFAULT_UP=new O(0,1,0);ln.DEFAULT_MATRIX_AUTO_UPDATE=!0;ln.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;var Ri=class extends ln{constructor(){super(),this.isGroup=!0,this.type="Group"}},wb={type:"move"},Ho=class{constructor(){this._targetRay=null,this._grip=null,this._hand=null}getHandSpace(){return this._hand===null&&(this._hand=new Ri,this._hand.matrixAutoUpdate=!1,this._hand.visible=!1,this._hand.joints={},this._hand.inputState={pinching:!1}),this._hand}getTargetRaySpace(){return this._targetRay===null&&(this._targetRay=new Ri,this._targetRay.matrixAutoUpdate=!1,this._targetRay.visible=!1,this._targetRay.hasLinearVelocity=!1,this._targetRay.linearVelocity=new O,this._targetRay.hasAngularVelocity=!1,this._targetRay.angularVelocity=new O),this._targetRay}getGripSpace(){return this._grip===null&&(this._grip=new Ri,this._grip.matrixAutoUpdate=!1,this._grip.visible=!1,this._grip.hasLinearVelocity=!1,this._grip.linearVelocity=new O,this._grip.hasAngularVelocity=!1,this._grip.angularVelocity=new O,this._grip.eventsEnabled=!1),this._grip}dispatchEvent(e){return this._targetRay!==null&&this._targetRay.dispatchEvent(e),this._grip!==null&&this._grip.dispatchEvent(e),this._hand!==null&&this._hand.dispatchEvent(e),this}connect(e){if(e&&e.hand){let t=this._hand;if(t)for(let i of e.hand.values())this._getHandJoint(t,i)}return this.dispatchEvent({type:"connected",data:e}),this}disconnect(e){return this.dispatchEvent({type:"disconnected",data:e}),this._targetRay!==null&&(this._targetRay.visible=!1),this._grip!==null&&(this._grip.visible=!1),this._hand!==null&&(this._hand.visible=!1),this}update(e,t,i){let s=null,r=null,o=null,a=this._targetRay,l=this._grip,c=this._hand;if(e&&t.session.visibilityState!=="visible-blurred"){if(c&&e.hand){o=!0;for(let v of e.hand.values()){let m=t.getJointPose(v,i),_=this._getHandJoint(c,v);m!==null&&(_.matrix.fromArray(m.transform.matrix),_.matrix.decompose(_.position,_.quaternion,_.scale),_.matrixWorldNeedsUpdate=!0,_.jointRadius=m.radius),_.visible=m!==null}let u=c.joints["index-finger-tip"],f=c.joints["thumb-tip"],d=u.position.distanceTo(f.position),p=.02,g=.005;c.inputState.pinching&&d>p+g?(c.inputState.pinching=!1,this.dispatchEvent({type:"pinchend",handedness:e.handedness,target:this})):!c.inputState.pinching&&d<=p-g&&(c.inputState.pinching=!0,this.dispatchEvent({type:"pinchstart",handedness:e.handedness,target:this}))}else l!==null&&e.gripSpace&&(r=t.getPose(e.gripSpace,i),r!==null&&(l.matrix.fromArray(r.transform.matrix),l.matrix.decompose(l.position,l.quaternion,l.scale),l.matrixWorldNeedsUpdate=!0,r.linearVelocity?(l.hasLinearVelocity=!0,l.linearVelocity.copy(r.linearVelocity)):l.hasLinearVelocity=!1,r.angularVelocity?(l.hasAngularVelocity=!0,l.angularVelocity.copy(r.angularVelocity)):l.hasAngularVelocity=!1,l.eventsEnabled&&l.dispatchEvent({type:"gripUpdated",data:e,target:this})));a!==null&&(s=t.getPose(e.targetRaySpace,i),s===null&&r!==null&&(s=r),s!==null&&(a.matrix.fromArray(s.transform.matrix),a.matrix.decompose(a.position,a.quaternion,a.scale),a.matrixWorldNeedsUpdate=!0,s.linearVelocity?(a.hasLinearVelocity=!0,a.linearVelocity.copy(s.linearVelocity)):a.hasLinearVelocity=!1,s.angularVelocity?(a.hasAngularVelocity=!0,a.angularVelocity.copy(s.angularVelocity)):a.hasAngularVelocity=!1,this.dispatchEvent(wb)))}return a!==null&&(a.visible=s!==null),l!==null&&(l.visible=r!==null),c!==null&&(c.visible=o!==null),this}_getHandJoint(e,t){if(e.joints[t.jointName]===void 0){let i=new Ri;i.matrixAutoUpdate=!1,i.visible=!1,e.joints[t.jointName]=i,e.add(i)}return e.joints[t.jointName]}},G_={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},or={h:0,s:0,l:0},dc={h:0,s:0,l:0};function qd(n,e,t){return t<0&&(t+=1),t>1&&(t-=1),t<1/6?n+(e-n)*6*t:t<1/2?e:t<2/3?n+(e-n)*6*(2/3-t):n}var it=class{constructor(e,t,i){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(e,t,i)}set(e,t,i){if(t===void 0&&i===void 0){let s=e;s&&s.isColor?this.copy(s):typeof s=="number"?this.setHex(s):typeof s=="string"&&this.setStyle(s)}else this.setRGB(e,t,i);return this}setScalar(e){return this.r=e,this.g=e,this.b=e,this}setHex(e,t=ui){return e=Math.floor(e),this.r=(e>>16&255)/255,this.g=(e>>8&255)/255,this.b=(e&255)/255,St.colorSpaceToWorking(this,t),this}setRGB(e,t,i,s=St.workingColorSpace){return this.r=e,this.g=t,this.b=i,St.colorSpaceToWorking(this,s),this}setHSL(e,t,i,s=St.workingColorSpace){if(e=$f(e,1),t=ht(t,0,1),i=ht(i,0,1),t===0)this.r=this.g=this.b=i;else{let r=i<=.5?i*(1+t):i+t-i*t,o=2*i-r;this.r=qd(o,r,e+1/3),this.g=qd(o,r,e),this.b=qd(o,r,e-1/3)}return St.colorSpaceToWorking(this,s),this}setStyle(e,t=ui){function i(r){r!==void 0&&parseFloat(r)<1&&Je("Color: Alpha component of "+e+" will be ignored.")}let s;if(s=/^(\w+)\(([^\)]*)\)/.exec(e)){let r,o=s[1],a=s[2];switch(o){case"rgb":case"rgba":if(r=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(255,parseInt(r[1],10))/255,Math.min(255,parseInt(r[2],10))/255,Math.min(255,parseInt(r[3],10))/255,t);if(r=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(100,parseFloat(r[1]))/100,Math.min(100,parseFloat(r[2]))/100,Math.min(100,parseFloat(r[3]))/100,t);break;case"hsl":case"hsla":if(r=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setHSL(parseFloat(r[1])/360,parseFloat(r[2])/100,parseFloat(r[3])/100,t);break;default:Je("Color: Unknown color model "+e)}}else if(s=/^\#([A-Fa-f\d]+)$/.exec(e)){let r=s[1],o=r.length;if(o===3)return this.setRGB(parseInt(r.charAt(0),16)/15,parseInt(r.charAt(1),16)/15,parseInt(r.charAt(2),16)/15,t);if(o===6)return this.setHex(parseInt(r,16),t);Je("Color: Invalid hex color "+e)}else if(e&&e.length>0)return this.setColorName(e,t);return this}setColorName(e,t=ui){let i=G_[e.toLowerCase()];return i!==void 0?this.setHex(i,t):Je("Color: Unknown color "+e),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(e){return this.r=e.r,this.g=e.g,this.b=e.b,this}copySRGBToLinear(e){return this.r=zs(e.r),this.g=zs(e.g),this.b=zs(e.b),this}copyLinearToSRGB(e){return this.r=Oo(e.r),this.g=Oo(e.g),this.b=Oo(e.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(e=ui){return St.workingToColorSpace(ti.copy(this),e),Math.round(ht(ti.r*255,0,255))*65536+Math.round(ht(ti.g*255,0,255))*256+Math.round(ht(ti.b*255,0,255))}getHexString(e=ui){return("000000"+this.getHex(e).toString(16)).slice(-6)}getHSL(e,t=St.workingColorSpace){St.workingToColorSpace(ti.copy(this),t);let i=ti.r,s=ti.g,r=ti.b,o=Math.max(i,s,r),a=Math.min(i,s,r),l,c,u=(a+o)/2;if(a===o)l=0,c=0;else{let f=o-a;switch(c=u<=.5?f/(o+a):f/(2-o-a),o){case i:l=(s-r)/f+(s<r?6:0);break;case s:l=(r-i)/f+2;break;case r:l=(i-s)/f+4;break}l/=6}return e.h=l,e.s=c,e.l=u,e}getRGB(e,t=St.workingColorSpace){return St.workingToColorSpace(ti.copy(this),t),e.r=ti.r,e.g=ti.g,e.b=ti.b,e}getStyle(e=ui){St.workingToColorSpace(ti.copy(this),e);let t=ti.r,i=ti.g,s=ti.b;return e!==ui?`color(${e} ${t.toFixed(3)} ${i.toFixed(3)} ${s.toFixed(3)})`:`rgb(${Math.round(t*255)},${Math.round(i*255)},${Math.round(s*255)})`}offsetHSL(e,t,i){return this.getHSL(or),this.setHSL(or.h+e,or.s+t,or.l+i)}add(e){return this.r+=e.r,this.g+=e.g,this.b+=e.b,this}addColors(e,t){return this.r=e.r+t.r,this.g=e.g+t.g,this.b=e.b+t.b,this}addScalar(e){return this.r+=e,this.g+=e,this.b+=e,this}sub(e){return this.r=Math.max(0,this.r-e.r),this.g=Math.max(0,this.g-e.g),this.b=Math.max(0,this.b-e.b),this}multiply(e){return this.r*=e.r,this.g*=e.g,this.b*=e.b,this}multiplyScalar(e){return this.r*=e,this.g*=e,this.b*=e,this}lerp(e,t){return this.r+=(e.r-this.r)*t,this.g+=(e.g-this.g)*t,this.b+=(e.b-this.b)*t,this}lerpColors(e,t,i){return this.r=e.r+(t.r-e.r)*i,this.g=e.g+(t.g-e.g)*i,this.b=e.b+(t.b-e.b)*i,this}lerpHSL(e,t){this.getHSL(or),e.getHSL(dc);let i=Va(or.h,dc.h,t),s=Va(or.s,dc.s,t),r=Va(or.l,dc.l,t);return this.setHSL(i,s,r),this}setFromVector3(e){return this.r=e.x,this.g=e.y,this.b=e.z,this}applyMatrix3(e){let t=this.r,i=this.g,s=this.b,r=e.elements;return this.r=r[0]*t+r[3]*i+r[6]*s,this.g=r[1]*t+r[4]*i+r[7]*s,this.b=r[2]*t+r[5]*i+r[8]*s,this}equals(e){return e.r===this.r&&e.g===this.g&&e.b===this.b}fromArray(e,t=0){return this.r=e[t],this.g=e[t+1],this.b=e[t+2],this}toArray(e=[],t=0){return e[t]=this.r,e[t+1]=this.g,e[t+2]=this.b,e}fromBufferAttribute(e,t){return this.r=e.getX(t),this.g=e.getY(t),this.b=e.getZ(t),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}},ti=new it;it.NAMES=G_;var $a=class extends ln{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new ts,this.environmentIntensity=1,this.environmentRotation=new ts,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(e,t){return super.copy(e,t),this.background=e.background!==null?e.background.clone():null,this.environment=e.environment!==null?e.environment.clone():null,this.fog=e.fog!==null?e.fog.clone():null,this.backgroundBlurriness=e.backgroundBlurriness,this.backgroundIntensity=e.backgroundIntensity,this.backgroundRotation.copy(e.backgroundRotation),this.environmentIntensity=e.environmentIntensity,this.environmentRotation.copy(e.environmentRotation),this.overrideMaterial=e.overrideMaterial!==null?e.overrideMaterial.clone():null,this.matrixAutoUpdate=e.matrixAutoUpdate,this}toJSON(e){let t=super.toJSON(e);return this.fog!==null&&(t.object.fog=this.fog.toJSON()),t.object.backgroundBlurriness=this.backgroundBlurriness,t.object.backgroundIntensity=this.backgroundIntensity,t.object.backgroundRotation=this.backgroundRotation.toArray(),t.object.environmentIntensity=this.environmentIntensity,t.object.environmentRotation=this.environmentRotation.toArray(),t}},Ki=new O,Os=new O,Yd=new O,Fs=new O,yo=new O,bo=new O,Ug=new O,$d=new O,Zd=new O,Jd=new O,Kd=new Nt,jd=new Nt,Qd=new Nt,ys=class n{constructor(e=new O,t=new O,i=new O){this.a=e,this.b=t,this.c=i}static getNormal(e,t,i,s){s.subVectors(i,t),Ki.subVectors(e,t),s.cross(Ki);let r=s.lengthSq();return r>0?s.multiplyScalar(1/Math.sqrt(r)):s.set(0,0,0)}static getBarycoord(e,t,i,s,r){Ki.subVectors(s,t),Os.subVectors(i,t),Yd.subVectors(e,t);let o=Ki.dot(Ki),a=Ki.dot(Os),l=Ki.dot(Yd),c=Os.dot(Os),u=Os.dot(Yd),f=o*c-a*a;if(f===0)return r.set(0,0,0),null;let d=1/f,p=(c*l-a*u)*d,g=(o*u-a*l)*d;return r.set(1-p-g,g,p)}static containsPoint(e,t,i,s){return this.getBarycoord(e,t,i,s,Fs)===null?!1:Fs.x>=0&&Fs.y>=0&&Fs.x+Fs.y<=1}static getInterpolation(e,t,i,s,r,o,a,l){return this.getBarycoord(e,t,i,s,Fs)===null?(l.x=0,l.y=0,"z"in l&&(l.z=0),"w"in l&&(l.w=0),null):(l.setScalar(0),l.addScaledVector(r,Fs.x),l.addScaledVector(o,Fs.y),l.addScaledVector(a,Fs.z),l)}static getInterpolatedAttribute(e,t,i,s,r,o){return Kd.setScalar(0),jd.setScalar(0),Qd.setScalar(0),Kd.fromBufferAttribute(e,t),jd.fromBufferAttribute(e,i),Qd.fromBufferAttribute(e,s),o.setScalar(0),o.addScaledVector(Kd,r.x),o.addScaledVector(jd,r.y),o.addScaledVector(Qd,r.z),o}static isFrontFacing(e,t,i,s){return Ki.subVectors(i,t),Os.subVectors(e,t),Ki.cross(Os).dot(s)<0}set(e,t,i){return this.a.copy(e),this.b.copy(t),this.c.copy(i),this}setFromPointsAndIndices(e,t,i,s){return this.a.copy(e[t]),this.b.copy(e[i]),this.c.copy(e[s]),this}setFromAttributeAndIndices(e,t,i,s){return this.a.fromBufferAttribute(e,t),this.b.fromBufferAttribute(e,i),this.c.fromBufferAttribute(e,s),this}clone(){return new this.constructor().copy(this)}copy(e){return this.a.copy(e.a),this.b.copy(e.b),this.c.copy(e.c),this}getArea(){return Ki.subVectors(this.c,this.b),Os.subVectors(this.a,this.b),Ki.cross(Os).length()*.5}getMidpoint(e){return e.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(e){return n.getNormal(this.a,this.b,this.c,e)}getPlane(e){return e.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(e,t){return n.getBarycoord(e,this.a,this.b,this.c,t)}getInterpolation(e,t,i,s,r){return n.getInterpolation(e,this.a,this.b,this.c,t,i,s,r)}containsPoint(e){return n.containsPoint(e,this.a,this.b,this.c)}isFrontFacing(e){return n.isFrontFacing(this.a,this.b,this.c,e)}intersectsBox(e){return e.intersectsTriangle(this)}closestPointToPoint(e,t){let i=this.a,s=this.b,r=this.c,o,a;yo.subVectors(s,i),bo.subVectors(r,i),$d.subVectors(e,i);let l=yo.dot($d),c=bo.dot($d);if(l<=0&&c<=0)return t.copy(i);Zd.subVectors(e,s);let u=yo.dot(Zd),f=bo.dot(Zd);if(u>=0&&f<=u)return t.copy(s);let d=l*f-u*c;if(d<=0&&l>=0&&u<=0&&l-u>0)return o=l/(l-u),t.copy(i).addScaledVector(yo,o);Jd.subVectors(e,r);let p=yo.dot(Jd),g=bo.dot(Jd);if(g>=0&&p<=g)return t.copy(r);let v=p*c-l*g;if(v<=0&&c>=0&&g<=0)return a=c/(c-g),t.copy(i).addScaledVector(bo,a);let m=u*g-p*f;if(m<=0&&f-u>=0&&p-g>=0)return Ug.subVectors(r,s),a=(f-u)/(f-u+(p-g)),t.copy(s).addScaledVector(Ug,a);let _=1/(m+v+d);return o=v*_,a=d*_,t.copy(i).addScaledVector(yo,o).addScaledVector(bo,a)}equals(e){return e.a.equals(this.a)&&e.b.equals(this.b)&&e.c.equals(this.c)}},pn=class{constructor(e=new O(1/0,1/0,1/0),t=new O(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=e,this.max=t}set(e,t){return this.min.copy(e),this.max.copy(t),this}setFromArray(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t+=3)this.expandByPoint(ji.fromArray(e,t));return this}setFromBufferAttribute(e){this.makeEmpty();for(let t=0,i=e.count;t<i;t++)this.expandByPoint(ji.fromBufferAttribute(e,t));return this}setFromPoints(e){this.makeEmpty();for(let t=0,i=e.length;t<i;t++)this.expandByPoint(e[t]);return this}setFromCenterAndSize(e,t){let i=ji.copy(t).multiplyScalar(.5);return this.min.copy(e).sub(i),this.max.copy(e).add(i),this}setFromObject(e,t=!1){return this.makeEmpty(),this.expandByObject(e,t)}clone(){return new this.constructor().copy(this)}copy(e){return this.min.copy(e.min),this.max.copy(e.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(e){return this.isEmpty()?e.set(0,0,0):e.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(e){return this.isEmpty()?e.set(0,0,0):e.subVectors(this.max,this.min)}expandByPoint(e){return this.min.min(e),this.max.max(e),this}expandByVector(e){return this.min.sub(e),this.max.add(e),this}expandByScalar(e){return this.min.addScalar(-e),this.max.addScalar(e),this}expandByObject(e,t=!1){e.updateWorldMatrix(!1,!1);let i=e.geometry;if(i!==void 0){let r=i.getAttribute("position");if(t===!0&&r!==void 0&&e.isInstancedMesh!==!0&&e.isBatchedMesh!==!0)for(let o=0,a=r.count;o<a;o++)e.isMesh===!0?e.getVertexPosition(o,ji):ji.fromBufferAttribute(r,o),ji.applyMatrix4(e.matrixWorld),this.expandByPoint(ji);else e.boundingBox!==void 0?(e.boundingBox===null&&e.computeBoundingBox(),fc.copy(e.boundingBox)):(i.boundingBox===null&&i.computeBoundingBox(),fc.copy(i.boundingBox)),fc.applyMatrix4(e.matrixWorld),this.union(fc)}let s=e.children;for(let r=0,o=s.length;r<o;r++)this.expandByObject(s[r],t);return this}containsPoint(e){return e.x>=this.min.x&&e.x<=this.max.x&&e.y>=this.min.y&&e.y<=this.max.y&&e.z>=this.min.z&&e.z<=this.max.z}containsBox(e){return this.min.x<=e.min.x&&e.max.x<=this.max.x&&this.min.y<=e.min.y&&e.max.y<=this.max.y&&this.min.z<=e.min.z&&e.max.z<=this.max.z}getParameter(e,t){return t.set((e.x-this.min.x)/(this.max.x-this.min.x),(e.y-this.min.y)/(this.max.y-this.min.y),(e.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(e){return e.max.x>=this.min.x&&e.min.x<=this.max.x&&e.max.y>=this.min.y&&e.min.y<=this.max.y&&e.max.z>=this.min.z&&e.min.z<=this.max.z}intersectsSphere(e){return this.clampPoint(e.center,ji),ji.distanceToSquared(e.center)<=e.radius*e.radius}intersectsPlane(e){let t,i;return e.normal.x>0?(t=e.normal.x*this.min.x,i=e.normal.x*this.max.x):(t=e.normal.x*this.max.x,i=e.normal.x*this.min.x),e.normal.y>0?(t+=e.normal.y*this.min.y,i+=e.normal.y*this.max.y):(t+=e.normal.y*this.max.y,i+=e.normal.y*this.min.y),e.normal.z>0?(t+=e.normal.z*this.min.z,i+=e.normal.z*this.max.z):(t+=e.normal.z*this.max.z,i+=e.normal.z*this.min.z),t<=-e.constant&&i>=-e.constant}intersectsTriangle(e){if(this.isEmpty())return!1;this.getCenter(Da),pc.subVectors(this.max,Da),So.subVectors(e.a,Da),Mo.subVectors(e.b,Da),wo.subVectors(e.c,Da),ar.subVectors(Mo,So),lr.subVectors(wo,Mo),Dr.subVectors(So,wo);let t=[0,-ar.z,ar.y,0,-lr.z,lr.y,0,-Dr.z,Dr.y,ar.z,0,-ar.x,lr.z,0,-lr.x,Dr.z,0,-Dr.x,-ar.y,ar.x,0,-lr.y,lr.x,0,-Dr.y,Dr.x,0];return!ef(t,So,Mo,wo,pc)||(t=[1,0,0,0,1,0,0,0,1],!ef(t,So,Mo,wo,pc))?!1:(mc.crossVectors(ar,lr),t=[mc.x,mc.y,mc.z],ef(t,So,Mo,wo,pc))}clampPoint(e,t){return t.copy(e).clamp(this.min,this.max)}distanceToPoint(e){return this.clampPoint(e,ji).distanceTo(e)}getBoundingSphere(e){return this.isEmpty()?e.makeEmpty():(this.getCenter(e.center),e.radius=this.getSize(ji).length()*.5),e}intersect(e){return this.min.max(e.min),this.max.min(e.max),this.isEmpty()&&this.makeEmpty(),this}union(e){return this.min.min(e.min),this.max.max(e.max),this}applyMatrix4(e){return this.isEmpty()?this:(ks[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(e),ks[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(e),ks[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(e),ks[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(e),ks[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(e),ks[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(e),ks[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(e),ks[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(e),this.setFromPoints(ks),this)}translate(e){return this.min.add(e),this.max.add(e),this}equals(e){return e.min.equals(this.min)&&e.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(e){return this.min.fromArray(e.min),this.max.fromArray(e.max),this}},ks=[new O,new O,new O,new O,new O,new O,new O,new O],ji=new O,fc=new pn,So=new O,Mo=new O,wo=new O,ar=new O,lr=new O,Dr=new O,Da=new O,pc=new O,mc=new O,Nr=new O;function ef(n,e,t,i,s){for(let r=0,o=n.length-3;r<=o;r+=3){Nr.fromArray(n,r);let a=s.x*Math.abs(Nr.x)+s.y*Math.abs(Nr.y)+s.z*Math.abs(Nr.z),l=e.dot(Nr),c=t.dot(Nr),u=i.dot(Nr);if(Math.max(-Math.max(l,c,u),Math.min(l,c,u))>a)return!1}return!0}var An=new O,gc=new Xe,Tb=0,Qi=class extends es{constructor(e,t,i=!1){if(super(),Array.isArray(e))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:Tb++}),this.name="",this.array=e,this.itemSize=t,this.count=e!==void 0?e.length/t:0,this.normalized=i,this.usage=qf,this.updateRanges=[],this.gpuType=rs,this.version=0,this._normalizationScale=e!==void 0?lh(e):void 0}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.name=e.name,this.array=new e.array.constructor(e.array),this.itemSize=e.itemSize,this.count=e.count,this.normalized=e.normalized,this.usage=e.usage,this.gpuType=e.gpuType,this._normalizationScale=e._normalizationScale,this}copyAt(e,t,i){e*=this.itemSize,i*=t.itemSize;for(let s=0,r=this.itemSize;s<r;s++)this.array[e+s]=t.array[i+s];return this}copyArray(e){return this.array.set(e),this}applyMatrix3(e){if(this.itemSize===2)for(let t=0,i=this.count;t<i;t++)gc.fromBufferAttribute(this,t),gc.applyMatrix3(e),this.setXY(t,gc.x,gc.y);else if(this.itemSize===3)for(let t=0,i=this.count;t<i;t++)An.fromBufferAttribute(this,t),An.applyMatrix3(e),this.setXYZ(t,An.x,An.y,An.z);return this}applyMatrix4(e){for(let t=0,i=this.count;t<i;t++)An.fromBufferAttribute(this,t),An.applyMatrix4(e),this.setXYZ(t,An.x,An.y,An.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)An.fromBufferAttribute(this,t),An.applyNormalMatrix(e),this.setXYZ(t,An.x,An.y,An.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)An.fromBufferAttribute(this,t),An.transformDirection(e),this.setXYZ(t,An.x,An.y,An.z);return this}set(e,t=0){return this.array.set(e,t),this}getComponent(e,t){let i=this.array[e*this.itemSize+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.array[e*this.itemSize+t]=i,this}getX(e){let t=this.array[e*this.itemSize];return this.normalized&&(t=this._denormalize(t)),t}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize]=t,this}getY(e){let t=this.array[e*this.itemSize+1];return this.normalized&&(t=this._denormalize(t)),t}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+1]=t,this}getZ(e){let t=this.array[e*this.itemSize+2];return this.normalized&&(t=this._denormalize(t)),t}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+2]=t,this}getW(e){let t=this.array[e*this.itemSize+3];return this.normalized&&(t=this._denormalize(t)),t}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.array[e*this.itemSize+3]=t,this}setXY(e,t,i){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.array[e+0]=t,this.array[e+1]=i,this}setXYZ(e,t,i,s){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e*=this.itemSize,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.array[e+0]=t,this.array[e+1]=i,this.array[e+2]=s,this.array[e+3]=r,this}onUpload(e){return this.onUploadCallback=e,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){let e={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return e.name=this.name,e.usage=this.usage,e.gpuType=this.gpuType,e}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):Jf(e,this.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Kf(e,this.array)}};var Za=class extends Qi{constructor(e,t,i){super(new Uint16Array(e),t,i)}};var Ja=class extends Qi{constructor(e,t,i){super(new Uint32Array(e),t,i)}};var Mt=class extends Qi{constructor(e,t,i){super(new Float32Array(e),t,i)}},Eb=new pn,Na=new O,tf=new O,Vi=class{constructor(e=new O,t=-1){this.isSphere=!0,this.center=e,this.radius=t}set(e,t){return this.center.copy(e),this.radius=t,this}setFromPoints(e,t){let i=this.center;t!==void 0?i.copy(t):Eb.setFromPoints(e).getCenter(i);let s=0;for(let r=0,o=e.length;r<o;r++)s=Math.max(s,i.distanceToSquared(e[r]));return this.radius=Math.sqrt(s),this}copy(e){return this.center.copy(e.center),this.radius=e.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(e){return e.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(e){return e.distanceTo(this.center)-this.radius}intersectsSphere(e){let t=this.radius+e.radius;return e.center.distanceToSquared(this.center)<=t*t}intersectsBox(e){return e.intersectsSphere(this)}intersectsPlane(e){return Math.abs(e.distanceToPoint(this.center))<=this.radius}clampPoint(e,t){let i=this.center.distanceToSquared(e);return t.copy(e),i>this.radius*this.radius&&(t.sub(this.center).normalize(),t.multiplyScalar(this.radius).add(this.center)),t}getBoundingBox(e){return this.isEmpty()?(e.makeEmpty(),e):(e.set(this.center,this.center),e.expandByScalar(this.radius),e)}applyMatrix4(e){return this.center.applyMatrix4(e),this.radius=this.radius*e.getMaxScaleOnAxis(),this}translate(e){return this.center.add(e),this}expandByPoint(e){if(this.isEmpty())return this.center.copy(e),this.radius=0,this;Na.subVectors(e,this.center);let t=Na.lengthSq();if(t>this.radius*this.radius){let i=Math.sqrt(t),s=(i-this.radius)*.5;this.center.addScaledVector(Na,s/i),this.radius+=s}return this}union(e){return e.isEmpty()?this:this.isEmpty()?(this.copy(e),this):(this.center.equals(e.center)===!0?this.radius=Math.max(this.radius,e.radius):(tf.subVectors(e.center,this.center).setLength(e.radius),this.expandByPoint(Na.copy(e.center).add(tf)),this.expandByPoint(Na.copy(e.center).sub(tf))),this)}equals(e){return e.center.equals(this.center)&&e.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(e){return this.radius=e.radius,this.center.fromArray(e.center),this}},Ab=0,Bi=new Et,nf=new ln,To=new O,Ai=new pn,Ua=new pn,Xn=new O,en=class n extends es{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:Ab++}),this.uuid=br(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(e){return Array.isArray(e)?this.index=new(jy(e)?Ja:Za)(e,1):this.index=e,this}setIndirect(e,t=0){return this.indirect=e,this.indirectOffset=t,this}getIndirect(){return this.indirect}getAttribute(e){return this.attributes[e]}setAttribute(e,t){return this.attributes[e]=t,this}deleteAttribute(e){return delete this.attributes[e],this}hasAttribute(e){return this.attributes[e]!==void 0}addGroup(e,t,i=0){this.groups.push({start:e,count:t,materialIndex:i})}clearGroups(){this.groups=[]}setDrawRange(e,t){this.drawRange.start=e,this.drawRange.count=t}applyMatrix4(e){let t=this.attributes.position;t!==void 0&&(t.applyMatrix4(e),t.needsUpdate=!0);let i=this.attributes.normal;if(i!==void 0){let r=new st().getNormalMatrix(e);i.applyNormalMatrix(r),i.needsUpdate=!0}let s=this.attributes.tangent;return s!==void 0&&(s.transformDirection(e),s.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(e){return Bi.makeRotationFromQuaternion(e),this.applyMatrix4(Bi),this}rotateX(e){return Bi.makeRotationX(e),this.applyMatrix4(Bi),this}rotateY(e){return Bi.makeRotationY(e),this.applyMatrix4(Bi),this}rotateZ(e){return Bi.makeRotationZ(e),this.applyMatrix4(Bi),this}translate(e,t,i){return Bi.makeTranslation(e,t,i),this.applyMatrix4(Bi),this}scale(e,t,i){return Bi.makeScale(e,t,i),this.applyMatrix4(Bi),this}lookAt(e){return nf.lookAt(e),nf.updateMatrix(),this.applyMatrix4(nf.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(To).negate(),this.translate(To.x,To.y,To.z),this}setFromPoints(e){let t=this.getAttribute("position");if(t===void 0){let i=[];for(let s=0,r=e.length;s<r;s++){let o=e[s];i.push(o.x,o.y,o.z||0)}this.setAttribute("position",new Mt(i,3))}else{let i=Math.min(e.length,t.count);for(let s=0;s<i;s++){let r=e[s];t.setXYZ(s,r.x,r.y,r.z||0)}e.length>t.count&&Je("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),t.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new pn);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Qe("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new O(-1/0,-1/0,-1/0),new O(1/0,1/0,1/0));return}if(e!==void 0){if(this.boundingBox.setFromBufferAttribute(e),t)for(let i=0,s=t.length;i<s;i++){let r=t[i];Ai.setFromBufferAttribute(r),this.morphTargetsRelative?(Xn.addVectors(this.boundingBox.min,Ai.min),this.boundingBox.expandByPoint(Xn),Xn.addVectors(this.boundingBox.max,Ai.max),this.boundingBox.expandByPoint(Xn)):(this.boundingBox.expandByPoint(Ai.min),this.boundingBox.expandByPoint(Ai.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&Qe('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Vi);let e=this.attributes.position,t=this.morphAttributes.position;if(e&&e.isGLBufferAttribute){Qe("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new O,1/0);return}if(e){let i=this.boundingSphere.center;if(Ai.setFromBufferAttribute(e),t)for(let r=0,o=t.length;r<o;r++){let a=t[r];Ua.setFromBufferAttribute(a),this.morphTargetsRelative?(Xn.addVectors(Ai.min,Ua.min),Ai.expandByPoint(Xn),Xn.addVectors(Ai.max,Ua.max),Ai.expandByPoint(Xn)):(Ai.expandByPoint(Ua.min),Ai.expandByPoint(Ua.max))}Ai.getCenter(i);let s=0;for(let r=0,o=e.count;r<o;r++)Xn.fromBufferAttribute(e,r),s=Math.max(s,i.distanceToSquared(Xn));if(t)for(let r=0,o=t.length;r<o;r++){let a=t[r],l=this.morphTargetsRelative;for(let c=0,u=a.count;c<u;c++)Xn.fromBufferAttribute(a,c),l&&(To.fromBufferAttribute(e,c),Xn.add(To)),s=Math.max(s,i.distanceToSquared(Xn))}this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&Qe('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){let e=this.index,t=this.attributes;if(e===null||t.position===void 0||t.normal===void 0||t.uv===void 0){Qe("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}let i=t.position,s=t.normal,r=t.uv,o=this.getAttribute("tangent");(o===void 0||o.count!==i.count)&&(o=new Qi(new Float32Array(4*i.count),4),this.setAttribute("tangent",o));let a=[],l=[],c=new Uint8Array(i.count);for(let N=0;N<i.count;N++)a[N]=new O,l[N]=new O;let u=new O,f=new O,d=new O,p=new Xe,g=new Xe,v=new Xe,m=new O,_=new O;function x(N,P,D){c[N]=c[P]=c[D]=1,u.fromBufferAttribute(i,N),f.fromBufferAttribute(i,P),d.fromBufferAttribute(i,D),p.fromBufferAttribute(r,N),g.fromBufferAttribute(r,P),v.fromBufferAttribute(r,D),f.sub(u),d.sub(u),g.sub(p),v.sub(p);let z=1/(g.x*v.y-v.x*g.y);isFinite(z)&&(m.copy(f).multiplyScalar(v.y).addScaledVector(d,-g.y).multiplyScalar(z),_.copy(d).multiplyScalar(g.x).addScaledVector(f,-v.x).multiplyScalar(z),a[N].add(m),a[P].add(m),a[D].add(m),l[N].add(_),l[P].add(_),l[D].add(_))}let T=this.groups;T.length===0&&(T=[{start:0,count:e.count}]);for(let N=0,P=T.length;N<P;++N){let D=T[N],z=D.start,G=D.count;for(let U=z,W=z+G;U<W;U+=3)x(e.getX(U+0),e.getX(U+1),e.getX(U+2))}let S=new O,R=new O,C=new O,y=new O;function M(N){C.fromBufferAttribute(s,N),y.copy(C);let P=a[N];S.copy(P),S.sub(C.multiplyScalar(C.dot(P))).normalize(),R.crossVectors(y,P);let z=R.dot(l[N])<0?-1:1;o.setXYZW(N,S.x,S.y,S.z,z)}for(let N=0,P=i.count;N<P;++N)c[N]&&M(N);this._transformed=!0}computeVertexNormals(){let e=this.index,t=this.getAttribute("position");if(t!==void 0){let i=this.getAttribute("normal");if(i===void 0||i.count!==t.count)i=new Qi(new Float32Array(t.count*3),3),this.setAttribute("normal",i);else for(let d=0,p=i.count;d<p;d++)i.setXYZ(d,0,0,0);let s=new O,r=new O,o=new O,a=new O,l=new O,c=new O,u=new O,f=new O;if(e)for(let d=0,p=e.count;d<p;d+=3){let g=e.getX(d+0),v=e.getX(d+1),m=e.getX(d+2);s.fromBufferAttribute(t,g),r.fromBufferAttribute(t,v),o.fromBufferAttribute(t,m),u.subVectors(o,r),f.subVectors(s,r),u.cross(f),a.fromBufferAttribute(i,g),l.fromBufferAttribute(i,v),c.fromBufferAttribute(i,m),a.add(u),l.add(u),c.add(u),i.setXYZ(g,a.x,a.y,a.z),i.setXYZ(v,l.x,l.y,l.z),i.setXYZ(m,c.x,c.y,c.z)}else for(let d=0,p=t.count;d<p;d+=3)s.fromBufferAttribute(t,d+0),r.fromBufferAttribute(t,d+1),o.fromBufferAttribute(t,d+2),u.subVectors(o,r),f.subVectors(s,r),u.cross(f),i.setXYZ(d+0,u.x,u.y,u.z),i.setXYZ(d+1,u.x,u.y,u.z),i.setXYZ(d+2,u.x,u.y,u.z);this.normalizeNormals(),i.needsUpdate=!0}}normalizeNormals(){let e=this.attributes.normal;for(let t=0,i=e.count;t<i;t++)Xn.fromBufferAttribute(e,t),Xn.normalize(),e.setXYZ(t,Xn.x,Xn.y,Xn.z)}toNonIndexed(){function e(a,l){let c=a.array,u=a.itemSize,f=a.normalized,d=new c.constructor(l.length*u),p=0,g=0;for(let v=0,m=l.length;v<m;v++){a.isInterleavedBufferAttribute?p=l[v]*a.data.stride+a.offset:p=l[v]*u;for(let _=0;_<u;_++)d[g++]=c[p++]}return new Qi(d,u,f)}if(this.index===null)return Je("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;let t=new n,i=this.index.array,s=this.attributes;for(let a in s){let l=s[a],c=e(l,i);t.setAttribute(a,c)}let r=this.morphAttributes;for(let a in r){let l=[],c=r[a];for(let u=0,f=c.length;u<f;u++){let d=c[u],p=e(d,i);l.push(p)}t.morphAttributes[a]=l}t.morphTargetsRelative=this.morphTargetsRelative;let o=this.groups;for(let a=0,l=o.length;a<l;a++){let c=o[a];t.addGroup(c.start,c.count,c.materialIndex)}return t}toJSON(){let e={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(e.uuid=this.uuid,e.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,e.name=this.name,Object.keys(this.userData).length>0&&(e.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){let l=this.parameters;for(let c in l)l[c]!==void 0&&(e[c]=l[c]);return e}e.data={attributes:{}};let t=this.index;t!==null&&(e.data.index={type:t.array.constructor.name,array:Array.prototype.slice.call(t.array)});let i=this.attributes;for(let l in i){let c=i[l];e.data.attributes[l]=c.toJSON(e.data)}let s={},r=!1;for(let l in this.morphAttributes){let c=this.morphAttributes[l],u=[];for(let f=0,d=c.length;f<d;f++){let p=c[f];u.push(p.toJSON(e.data))}u.length>0&&(s[l]=u,r=!0)}r&&(e.data.morphAttributes=s,e.data.morphTargetsRelative=this.morphTargetsRelative);let o=this.groups;o.length>0&&(e.data.groups=JSON.parse(JSON.stringify(o)));let a=this.boundingSphere;return a!==null&&(e.data.boundingSphere=a.toJSON()),e}clone(){return new this.constructor().copy(this)}copy(e){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;let t={};this.name=e.name;let i=e.index;i!==null&&this.setIndex(i.clone());let s=e.attributes;for(let c in s){let u=s[c];this.setAttribute(c,u.clone(t))}let r=e.morphAttributes;for(let c in r){let u=[],f=r[c];for(let d=0,p=f.length;d<p;d++)u.push(f[d].clone(t));this.morphAttributes[c]=u}this.morphTargetsRelative=e.morphTargetsRelative;let o=e.groups;for(let c=0,u=o.length;c<u;c++){let f=o[c];this.addGroup(f.start,f.count,f.materialIndex)}let a=e.boundingBox;a!==null&&(this.boundingBox=a.clone());let l=e.boundingSphere;return l!==null&&(this.boundingSphere=l.clone()),this.drawRange.start=e.drawRange.start,this.drawRange.count=e.drawRange.count,this.userData=e.userData,this._transformed=e._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}},Ka=class{constructor(e,t){this.isInterleavedBuffer=!0,this.array=e,this.stride=t,this.count=e!==void 0?e.length/t:0,this.usage=qf,this.updateRanges=[],this.version=0,this.uuid=br()}onUploadCallback(){}set needsUpdate(e){e===!0&&this.version++}setUsage(e){return this.usage=e,this}addUpdateRange(e,t){this.updateRanges.push({start:e,count:t})}clearUpdateRanges(){this.updateRanges.length=0}copy(e){return this.array=new e.array.constructor(e.array),this.count=e.count,this.stride=e.stride,this.usage=e.usage,this}copyAt(e,t,i){e*=this.stride,i*=t.stride;for(let s=0,r=this.stride;s<r;s++)this.array[e+s]=t.array[i+s];return this}set(e,t=0){return this.array.set(e,t),this}clone(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=Og(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=this.array.slice(0).buffer);let i=new this.array.constructor(e.arrayBuffers[t]),s=new this.constructor(i,this.stride);return s.setUsage(this.usage),s}onUpload(e){return this.onUploadCallback=e,this}toJSON(e){e.arrayBuffers===void 0&&(e.arrayBuffers={});let t=Og(this.array);e.arrayBuffers[t]===void 0&&(e.arrayBuffers[t]=Array.from(new Uint32Array(this.array.slice(0).buffer)));let i={uuid:this.uuid,buffer:t,type:this.array.constructor.name,stride:this.stride};return i.usage=this.usage,i}};function Og(n){return n.buffer._uuid===void 0&&(n.buffer._uuid=br()),n.byteOffset===0&&n.byteLength===n.buffer.byteLength?n.buffer._uuid:n.buffer._uuid+":"+n.byteOffset+":"+n.byteLength}var ci=new O,Ii=class n{constructor(e,t,i,s=!1){this.isInterleavedBufferAttribute=!0,this.name="",this.data=e,this.itemSize=t,this.offset=i,this.normalized=s,this._normalizationScale=e!==void 0?lh(e.array):void 0}get count(){return this.data.count}get array(){return this.data.array}set needsUpdate(e){this.data.needsUpdate=e}applyMatrix4(e){for(let t=0,i=this.data.count;t<i;t++)ci.fromBufferAttribute(this,t),ci.applyMatrix4(e),this.setXYZ(t,ci.x,ci.y,ci.z);return this}applyNormalMatrix(e){for(let t=0,i=this.count;t<i;t++)ci.fromBufferAttribute(this,t),ci.applyNormalMatrix(e),this.setXYZ(t,ci.x,ci.y,ci.z);return this}transformDirection(e){for(let t=0,i=this.count;t<i;t++)ci.fromBufferAttribute(this,t),ci.transformDirection(e),this.setXYZ(t,ci.x,ci.y,ci.z);return this}getComponent(e,t){let i=this.array[e*this.data.stride+this.offset+t];return this.normalized&&(i=this._denormalize(i)),i}setComponent(e,t,i){return this.normalized&&(i=this._normalize(i)),this.data.array[e*this.data.stride+this.offset+t]=i,this}setX(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset]=t,this}setY(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+1]=t,this}setZ(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+2]=t,this}setW(e,t){return this.normalized&&(t=this._normalize(t)),this.data.array[e*this.data.stride+this.offset+3]=t,this}getX(e){let t=this.data.array[e*this.data.stride+this.offset];return this.normalized&&(t=this._denormalize(t)),t}getY(e){let t=this.data.array[e*this.data.stride+this.offset+1];return this.normalized&&(t=this._denormalize(t)),t}getZ(e){let t=this.data.array[e*this.data.stride+this.offset+2];return this.normalized&&(t=this._denormalize(t)),t}getW(e){let t=this.data.array[e*this.data.stride+this.offset+3];return this.normalized&&(t=this._denormalize(t)),t}setXY(e,t,i){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i)),this.data.array[e+0]=t,this.data.array[e+1]=i,this}setXYZ(e,t,i,s){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this}setXYZW(e,t,i,s,r){return e=e*this.data.stride+this.offset,this.normalized&&(t=this._normalize(t),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.data.array[e+0]=t,this.data.array[e+1]=i,this.data.array[e+2]=s,this.data.array[e+3]=r,this}clone(e){if(e===void 0){qa("InterleavedBufferAttribute.clone(): Cloning an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return new Qi(new this.array.constructor(t),this.itemSize,this.normalized)}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.clone(e)),new n(e.interleavedBuffers[this.data.uuid],this.itemSize,this.offset,this.normalized)}toJSON(e){if(e===void 0){qa("InterleavedBufferAttribute.toJSON(): Serializing an interleaved buffer attribute will de-interleave buffer data.");let t=[];for(let i=0;i<this.count;i++){let s=i*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)t.push(this.data.array[s+r])}return{itemSize:this.itemSize,type:this.array.constructor.name,array:t,normalized:this.normalized}}else return e.interleavedBuffers===void 0&&(e.interleavedBuffers={}),e.interleavedBuffers[this.data.uuid]===void 0&&(e.interleavedBuffers[this.data.uuid]=this.data.toJSON(e)),{isInterleavedBufferAttribute:!0,itemSize:this.itemSize,data:this.data.uuid,offset:this.offset,normalized:this.normalized}}_denormalize(e){let t=this._normalizationScale;return t!==void 0?Math.max(e/t,-1):Jf(e,this.data.array)}_normalize(e){let t=this._normalizationScale;return t!==void 0?Math.round(e*t):Kf(e,this.data.array)}},sf=new O,Cb=new O,Rb=new st,Ci=class{constructor(e=new O(1,0,0),t=0){this.isPlane=!0,this.normal=e,this.constant=t}set(e,t){return this.normal.copy(e),this.constant=t,this}setComponents(e,t,i,s){return this.normal.set(e,t,i),this.constant=s,this}setFromNormalAndCoplanarPoint(e,t){return this.normal.copy(e),this.constant=-t.dot(this.normal),this}setFromCoplanarPoints(e,t,i){let s=sf.subVectors(i,t).cross(Cb.subVectors(e,t)).normalize();return this.setFromNormalAndCoplanarPoint(s,e),this}copy(e){return this.normal.copy(e.normal),this.constant=e.constant,this}normalize(){let e=1/this.normal.length();return this.normal.multiplyScalar(e),this.constant*=e,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(e){return this.normal.dot(e)+this.constant}distanceToSphere(e){return this.distanceToPoint(e.center)-e.radius}projectPoint(e,t){return t.copy(e).addScaledVector(this.normal,-this.distanceToPoint(e))}intersectLine(e,t,i=!0){let s=e.delta(sf),r=this.normal.dot(s);if(r===0)return this.distanceToPoint(e.start)===0?t.copy(e.start):null;let o=-(e.start.dot(this.normal)+this.constant)/r;return i===!0&&(o<0||o>1)?null:t.copy(e.start).addScaledVector(s,o)}intersectsLine(e){let t=this.distanceToPoint(e.start),i=this.distanceToPoint(e.end);return t<0&&i>0||i<0&&t>0}intersectsBox(e){return e.intersectsPlane(this)}intersectsSphere(e){return e.intersectsPlane(this)}coplanarPoint(e){return e.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(e,t){let i=t||Rb.getNormalMatrix(e),s=this.coplanarPoint(sf).applyMatrix4(e),r=this.normal.applyMatrix3(i).normalize();return this.constant=-s.dot(r),this}translate(e){return this.constant-=e.dot(this.normal),this}equals(e){return e.normal.equals(this.normal)&&e.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(e){return this.normal.fromArray(e.normal),this.constant=e.constant,this}},Pb=0,ns=class extends es{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:Pb++}),this.uuid=br(),this.name="",this.type="Material",this.blending=Ko,this.side=xr,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=Tf,this.blendDst=Ef,this.blendEquation=Gr,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new it(0,0,0),this.blendAlpha=0,this.depthFunc=Fo,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=L_,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=Gc,this.stencilZFail=Gc,this.stencilZPass=Gc,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(e){this._alphaTest>0!=e>0&&this.version++,this._alphaTest=e}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(e){if(e!==void 0)for(let t in e){let i=e[t];if(i===void 0){Je(`Material: parameter '${t}' has value of undefined.`);continue}let s=this[t];if(s===void 0){Je(`Material: '${t}' is not a property of THREE.${this.type}.`);continue}s&&s.isColor?s.set(i):s&&s.isVector2&&i&&i.isVector2||s&&s.isEuler&&i&&i.isEuler||s&&s.isVector3&&i&&i.isVector3?s.copy(i):this[t]=i}}toJSON(e){let t=e===void 0||typeof e=="string";t&&(e={textures:{},images:{}});let i={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};i.uuid=this.uuid,i.type=this.type,i.blending=this.blending,i.side=this.side,i.shadowSide=this.shadowSide,i.vertexColors=this.vertexColors,i.opacity=this.opacity,i.transparent=this.transparent,i.blendSrc=this.blendSrc,i.blendDst=this.blendDst,i.blendEquation=this.blendEquation,i.blendSrcAlpha=this.blendSrcAlpha,i.blendDstAlpha=this.blendDstAlpha,i.blendEquationAlpha=this.blendEquationAlpha,i.blendColor=this.blendColor.getHex(),i.blendAlpha=this.blendAlpha,i.depthFunc=this.depthFunc,i.depthTest=this.depthTest,i.depthWrite=this.depthWrite,i.colorWrite=this.colorWrite,i.clipIntersection=this.clipIntersection,i.clipShadows=this.clipShadows,i.stencilWriteMask=this.stencilWriteMask,i.stencilFunc=this.stencilFunc,i.stencilRef=this.stencilRef,i.stencilFuncMask=this.stencilFuncMask,i.stencilFail=this.stencilFail,i.stencilZFail=this.stencilZFail,i.stencilZPass=this.stencilZPass,i.stencilWrite=this.stencilWrite,i.polygonOffset=this.polygonOffset,i.polygonOffsetFactor=this.polygonOffsetFactor,i.polygonOffsetUnits=this.polygonOffsetUnits,i.dithering=this.dithering,i.alphaTest=this.alphaTest,i.alphaHash=this.alphaHash,i.alphaToCoverage=this.alphaToCoverage,i.premultipliedAlpha=this.premultipliedAlpha,i.forceSinglePass=this.forceSinglePass,i.allowOverride=this.allowOverride,i.visible=this.visible,i.toneMapped=this.toneMapped,i.name=this.name,this.color&&this.color.isColor&&(i.color=this.color.getHex()),this.roughness!==void 0&&(i.roughness=this.roughness),this.metalness!==void 0&&(i.metalness=this.metalness),this.sheen!==void 0&&(i.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(i.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(i.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(i.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(i.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(i.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(i.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(i.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(i.shininess=this.shininess),this.clearcoat!==void 0&&(i.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(i.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(i.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(i.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(e).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(i.clearcoatMap=this.clearcoatMap.toJSON(e).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(i.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(e).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(i.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(e).uuid,i.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(i.sheenColorMap=this.sheenColorMap.toJSON(e).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(i.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(e).uuid),this.dispersion!==void 0&&(i.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(i.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(i.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(i.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(i.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(i.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(i.iridescenceMap=this.iridescenceMap.toJSON(e).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(i.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(e).uuid),this.anisotropy!==void 0&&(i.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(i.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(i.anisotropyMap=this.anisotropyMap.toJSON(e).uuid),this.map&&this.map.isTexture&&(i.map=this.map.toJSON(e).uuid),this.matcap&&this.matcap.isTexture&&(i.matcap=this.matcap.toJSON(e).uuid),this.alphaMap&&this.alphaMap.isTexture&&(i.alphaMap=this.alphaMap.toJSON(e).uuid),this.lightMap&&this.lightMap.isTexture&&(i.lightMap=this.lightMap.toJSON(e).uuid,i.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(i.aoMap=this.aoMap.toJSON(e).uuid,i.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(i.bumpMap=this.bumpMap.toJSON(e).uuid,i.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(i.normalMap=this.normalMap.toJSON(e).uuid,i.normalMapType=this.normalMapType,i.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(i.displacementMap=this.displacementMap.toJSON(e).uuid,i.displacementScale=this.displacementScale,i.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(i.roughnessMap=this.roughnessMap.toJSON(e).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(i.metalnessMap=this.metalnessMap.toJSON(e).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(i.emissiveMap=this.emissiveMap.toJSON(e).uuid),this.specularMap&&this.specularMap.isTexture&&(i.specularMap=this.specularMap.toJSON(e).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(i.specularIntensityMap=this.specularIntensityMap.toJSON(e).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(i.specularColorMap=this.specularColorMap.toJSON(e).uuid),this.envMap&&this.envMap.isTexture&&(i.envMap=this.envMap.toJSON(e).uuid,this.combine!==void 0&&(i.combine=this.combine)),this.envMapRotation!==void 0&&(i.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(i.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(i.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(i.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(i.gradientMap=this.gradientMap.toJSON(e).uuid),this.transmission!==void 0&&(i.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(i.transmissionMap=this.transmissionMap.toJSON(e).uuid),this.thickness!==void 0&&(i.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(i.thicknessMap=this.thicknessMap.toJSON(e).uuid),this.attenuationDistance!==void 0&&(i.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(i.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(i.size=this.size),this.sizeAttenuation!==void 0&&(i.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(i.clippingPlanes=this.clippingPlanes.map(r=>r.toJSON())),this.rotation!==void 0&&(i.rotation=this.rotation),this.depthPacking!==void 0&&(i.depthPacking=this.depthPacking),this.linewidth!==void 0&&(i.linewidth=this.linewidth),this.linecap!==void 0&&(i.linecap=this.linecap),this.linejoin!==void 0&&(i.linejoin=this.linejoin),this.dashSize!==void 0&&(i.dashSize=this.dashSize),this.gapSize!==void 0&&(i.gapSize=this.gapSize),this.scale!==void 0&&(i.scale=this.scale),this.wireframe!==void 0&&(i.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(i.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(i.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(i.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(i.flatShading=this.flatShading),this.fog!==void 0&&(i.fog=this.fog),Object.keys(this.userData).length>0&&(i.userData=this.userData);function s(r){let o=[];for(let a in r){let l=r[a];delete l.metadata,o.push(l)}return o}if(t){let r=s(e.textures),o=s(e.images);r.length>0&&(i.textures=r),o.length>0&&(i.images=o)}return i}fromJSON(e,t){if(e.uuid!==void 0&&(this.uuid=e.uuid),e.name!==void 0&&(this.name=e.name),e.color!==void 0&&this.color!==void 0&&this.color.setHex(e.color),e.roughness!==void 0&&(this.roughness=e.roughness),e.metalness!==void 0&&(this.metalness=e.metalness),e.sheen!==void 0&&(this.sheen=e.sheen),e.sheenColor!==void 0&&(this.sheenColor=new it().setHex(e.sheenColor)),e.sheenRoughness!==void 0&&(this.sheenRoughness=e.sheenRoughness),e.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(e.emissive),e.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(e.specular),e.specularIntensity!==void 0&&(this.specularIntensity=e.specularIntensity),e.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(e.specularColor),e.shininess!==void 0&&(this.shininess=e.shininess),e.clearcoat!==void 0&&(this.clearcoat=e.clearcoat),e.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=e.clearcoatRoughness),e.diffuseRoughness!==void 0&&(this.diffuseRoughness=e.diffuseRoughness),e.dispersion!==void 0&&(this.dispersion=e.dispersion),e.retroreflectivity!==void 0&&(this.retroreflectivity=e.retroreflectivity),e.iridescence!==void 0&&(this.iridescence=e.iridescence),e.iridescenceIOR!==void 0&&(this.iridescenceIOR=e.iridescenceIOR),e.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessMinimum),e.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=e.iridescenceThicknessMaximum),e.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=e.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=e.iridescenceThicknessRange[1]),e.transmission!==void 0&&(this.transmission=e.transmission),e.thickness!==void 0&&(this.thickness=e.thickness),e.attenuationDistance!==void 0&&(this.attenuationDistance=e.attenuationDistance),e.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(e.attenuationColor),e.anisotropy!==void 0&&(this.anisotropy=e.anisotropy),e.anisotropyRotation!==void 0&&(this.anisotropyRotation=e.anisotropyRotation),e.fog!==void 0&&(this.fog=e.fog),e.flatShading!==void 0&&(this.flatShading=e.flatShading),e.blending!==void 0&&(this.blending=e.blending),e.combine!==void 0&&(this.combine=e.combine),e.side!==void 0&&(this.side=e.side),e.shadowSide!==void 0&&(this.shadowSide=e.shadowSide),e.opacity!==void 0&&(this.opacity=e.opacity),e.transparent!==void 0&&(this.transparent=e.transparent),e.alphaTest!==void 0&&(this.alphaTest=e.alphaTest),e.alphaHash!==void 0&&(this.alphaHash=e.alphaHash),e.depthFunc!==void 0&&(this.depthFunc=e.depthFunc),e.depthTest!==void 0&&(this.depthTest=e.depthTest),e.depthWrite!==void 0&&(this.depthWrite=e.depthWrite),e.colorWrite!==void 0&&(this.colorWrite=e.colorWrite),e.clippingPlanes!==void 0&&(this.clippingPlanes=e.clippingPlanes.map(i=>new Ci().fromJSON(i))),e.clipIntersection!==void 0&&(this.clipIntersection=e.clipIntersection),e.clipShadows!==void 0&&(this.clipShadows=e.clipShadows),e.depthPacking!==void 0&&(this.depthPacking=e.depthPacking),e.blendSrc!==void 0&&(this.blendSrc=e.blendSrc),e.blendDst!==void 0&&(this.blendDst=e.blendDst),e.blendEquation!==void 0&&(this.blendEquation=e.blendEquation),e.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=e.blendSrcAlpha),e.blendDstAlpha!==void 0&&(this.blendDstAlpha=e.blendDstAlpha),e.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=e.blendEquationAlpha),e.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(e.blendColor),e.blendAlpha!==void 0&&(this.blendAlpha=e.blendAlpha),e.stencilWriteMask!==void 0&&(this.stencilWriteMask=e.stencilWriteMask),e.stencilFunc!==void 0&&(this.stencilFunc=e.stencilFunc),e.stencilRef!==void 0&&(this.stencilRef=e.stencilRef),e.stencilFuncMask!==void 0&&(this.stencilFuncMask=e.stencilFuncMask),e.stencilFail!==void 0&&(this.stencilFail=e.stencilFail),e.stencilZFail!==void 0&&(this.stencilZFail=e.stencilZFail),e.stencilZPass!==void 0&&(this.stencilZPass=e.stencilZPass),e.stencilWrite!==void 0&&(this.stencilWrite=e.stencilWrite),e.wireframe!==void 0&&(this.wireframe=e.wireframe),e.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=e.wireframeLinewidth),e.wireframeLinecap!==void 0&&(this.wireframeLinecap=e.wireframeLinecap),e.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=e.wireframeLinejoin),e.rotation!==void 0&&(this.rotation=e.rotation),e.linewidth!==void 0&&(this.linewidth=e.linewidth),e.linecap!==void 0&&(this.linecap=e.linecap),e.linejoin!==void 0&&(this.linejoin=e.linejoin),e.dashSize!==void 0&&(this.dashSize=e.dashSize),e.gapSize!==void 0&&(this.gapSize=e.gapSize),e.scale!==void 0&&(this.scale=e.scale),e.polygonOffset!==void 0&&(this.polygonOffset=e.polygonOffset),e.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=e.polygonOffsetFactor),e.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=e.polygonOffsetUnits),e.dithering!==void 0&&(this.dithering=e.dithering),e.alphaToCoverage!==void 0&&(this.alphaToCoverage=e.alphaToCoverage),e.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=e.premultipliedAlpha),e.forceSinglePass!==void 0&&(this.forceSinglePass=e.forceSinglePass),e.allowOverride!==void 0&&(this.allowOverride=e.allowOverride),e.visible!==void 0&&(this.visible=e.visible),e.toneMapped!==void 0&&(this.toneMapped=e.toneMapped),e.userData!==void 0&&(this.userData=e.userData),e.vertexColors!==void 0&&(typeof e.vertexColors=="number"?this.vertexColors=e.vertexColors>0:this.vertexColors=e.vertexColors),e.size!==void 0&&(this.size=e.size),e.sizeAttenuation!==void 0&&(this.sizeAttenuation=e.sizeAttenuation),e.map!==void 0&&(this.map=t[e.map]||null),e.matcap!==void 0&&(this.matcap=t[e.matcap]||null),e.alphaMap!==void 0&&(this.alphaMap=t[e.alphaMap]||null),e.bumpMap!==void 0&&(this.bumpMap=t[e.bumpMap]||null),e.bumpScale!==void 0&&(this.bumpScale=e.bumpScale),e.normalMap!==void 0&&(this.normalMap=t[e.normalMap]||null),e.normalMapType!==void 0&&(this.normalMapType=e.normalMapType),e.normalScale!==void 0){let i=e.normalScale;Array.isArray(i)===!1&&(i=[i,i]),this.normalScale=new Xe().fromArray(i)}return e.displacementMap!==void 0&&(this.displacementMap=t[e.displacementMap]||null),e.displacementScale!==void 0&&(this.displacementScale=e.displacementScale),e.displacementBias!==void 0&&(this.displacementBias=e.displacementBias),e.roughnessMap!==void 0&&(this.roughnessMap=t[e.roughnessMap]||null),e.metalnessMap!==void 0&&(this.metalnessMap=t[e.metalnessMap]||null),e.emissiveMap!==void 0&&(this.emissiveMap=t[e.emissiveMap]||null),e.emissiveIntensity!==void 0&&(this.emissiveIntensity=e.emissiveIntensity),e.specularMap!==void 0&&(this.specularMap=t[e.specularMap]||null),e.specularIntensityMap!==void 0&&(this.specularIntensityMap=t[e.specularIntensityMap]||null),e.specularColorMap!==void 0&&(this.specularColorMap=t[e.specularColorMap]||null),e.envMap!==void 0&&(this.envMap=t[e.envMap]||null),e.envMapRotation!==void 0&&this.envMapRotation.fromArray(e.envMapRotation),e.envMapIntensity!==void 0&&(this.envMapIntensity=e.envMapIntensity),e.reflectivity!==void 0&&(this.reflectivity=e.reflectivity),e.refractionRatio!==void 0&&(this.refractionRatio=e.refractionRatio),e.lightMap!==void 0&&(this.lightMap=t[e.lightMap]||null),e.lightMapIntensity!==void 0&&(this.lightMapIntensity=e.lightMapIntensity),e.aoMap!==void 0&&(this.aoMap=t[e.aoMap]||null),e.aoMapIntensity!==void 0&&(this.aoMapIntensity=e.aoMapIntensity),e.gradientMap!==void 0&&(this.gradientMap=t[e.gradientMap]||null),e.clearcoatMap!==void 0&&(this.clearcoatMap=t[e.clearcoatMap]||null),e.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=t[e.clearcoatRoughnessMap]||null),e.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=t[e.clearcoatNormalMap]||null),e.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new Xe().fromArray(e.clearcoatNormalScale)),e.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=t[e.diffuseRoughnessMap]||null),e.iridescenceMap!==void 0&&(this.iridescenceMap=t[e.iridescenceMap]||null),e.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=t[e.iridescenceThicknessMap]||null),e.transmissionMap!==void 0&&(this.transmissionMap=t[e.transmissionMap]||null),e.thicknessMap!==void 0&&(this.thicknessMap=t[e.thicknessMap]||null),e.anisotropyMap!==void 0&&(this.anisotropyMap=t[e.anisotropyMap]||null),e.sheenColorMap!==void 0&&(this.sheenColorMap=t[e.sheenColorMap]||null),e.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=t[e.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(e){this.name=e.name,this.blending=e.blending,this.side=e.side,this.vertexColors=e.vertexColors,this.opacity=e.opacity,this.transparent=e.transparent,this.blendSrc=e.blendSrc,this.blendDst=e.blendDst,this.blendEquation=e.blendEquation,this.blendSrcAlpha=e.blendSrcAlpha,this.blendDstAlpha=e.blendDstAlpha,this.blendEquationAlpha=e.blendEquationAlpha,this.blendColor.copy(e.blendColor),this.blendAlpha=e.blendAlpha,this.depthFunc=e.depthFunc,this.depthTest=e.depthTest,this.depthWrite=e.depthWrite,this.stencilWriteMask=e.stencilWriteMask,this.stencilFunc=e.stencilFunc,this.stencilRef=e.stencilRef,this.stencilFuncMask=e.stencilFuncMask,this.stencilFail=e.stencilFail,this.stencilZFail=e.stencilZFail,this.stencilZPass=e.stencilZPass,this.stencilWrite=e.stencilWrite;let t=e.clippingPlanes,i=null;if(t!==null){let s=t.length;i=new Array(s);for(let r=0;r!==s;++r)i[r]=t[r].clone()}return this.clippingPlanes=i,this.clipIntersection=e.clipIntersection,this.clipShadows=e.clipShadows,this.shadowSide=e.shadowSide,this.colorWrite=e.colorWrite,this.precision=e.precision,this.polygonOffset=e.polygonOffset,this.polygonOffsetFactor=e.polygonOffsetFactor,this.polygonOffsetUnits=e.polygonOffsetUnits,this.dithering=e.dithering,this.alphaTest=e.alphaTest,this.alphaHash=e.alphaHash,this.alphaToCoverage=e.alphaToCoverage,this.premultipliedAlpha=e.premultipliedAlpha,this.forceSinglePass=e.forceSinglePass,this.allowOverride=e.allowOverride,this.visible=e.visible,this.toneMapped=e.toneMapped,this.userData=JSON.parse(JSON.stringify(e.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(e){e===!0&&this.version++}},Wo=class extends ns{constructor(e){super(),this.isSpriteMaterial=!0,this.type="SpriteMaterial",this.color=new it(16777215),this.map=null,this.alphaMap=null,this.rotation=0,this.sizeAttenuation=!0,this.transparent=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.rotation=e.rotation,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}},Eo,Oa=new O,Ao=new O,Co=new O,Ro=new Xe,Fa=new Xe,H_=new Et,_c=new O,ka=new O,vc=new O,Fg=new Xe,rf=new Xe,kg=new Xe,ja=class extends ln{constructor(e=new Wo){if(super(),this.isSprite=!0,this.type="Sprite",Eo===void 0){Eo=new en;let t=new Float32Array([-.5,-.5,0,0,0,.5,-.5,0,1,0,.5,.5,0,1,1,-.5,.5,0,0,1]),i=new Ka(t,5);Eo.setIndex([0,1,2,0,2,3]),Eo.setAttribute("position",new Ii(i,3,0,!1)),Eo.setAttribute("uv",new Ii(i,2,3,!1))}this.geometry=Eo,this.material=e,this.center=new Xe(.5,.5),this.count=1}intersectsFrustum(e){return e.intersectsSprite(this)}raycast(e,t){e.camera===null&&Qe('Sprite: "Raycaster.camera" needs to be set in order to raycast against sprites.'),Ao.setFromMatrixScale(this.matrixWorld),H_.copy(e.camera.matrixWorld),this.modelViewMatrix.multiplyMatrices(e.camera.matrixWorldInverse,this.matrixWorld),Co.setFromMatrixPosition(this.modelViewMatrix),e.camera.isPerspectiveCamera&&this.material.sizeAttenuation===!1&&Ao.multiplyScalar(-Co.z);let i=this.material.rotation,s,r;i!==0&&(r=Math.cos(i),s=Math.sin(i));let o=this.center;xc(_c.set(-.5,-.5,0),Co,o,Ao,s,r),xc(ka.set(.5,-.5,0),Co,o,Ao,s,r),xc(vc.set(.5,.5,0),Co,o,Ao,s,r),Fg.set(0,0),rf.set(1,0),kg.set(1,1);let a=e.ray.intersectTriangle(_c,ka,vc,!1,Oa);if(a===null&&(xc(ka.set(-.5,.5,0),Co,o,Ao,s,r),rf.set(0,1),a=e.ray.intersectTriangle(_c,vc,ka,!1,Oa),a===null))return;let l=e.ray.origin.distanceTo(Oa);l<e.near||l>e.far||t.push({distance:l,point:Oa.clone(),uv:ys.getInterpolation(Oa,_c,ka,vc,Fg,rf,kg,new Xe),face:null,object:this})}copy(e,t){return super.copy(e,t),e.center!==void 0&&this.center.copy(e.center),this.material=e.material,this}toJSON(e){let t=super.toJSON(e);return t.object.center=this.center.toArray(),t}};function xc(n,e,t,i,s,r){Ro.subVectors(n,t).addScalar(.5).multiply(i),s!==void 0?(Fa.x=r*Ro.x-s*Ro.y,Fa.y=s*Ro.x+r*Ro.y):Fa.copy(Ro),n.copy(e),n.x+=Fa.x,n.y+=Fa.y,n.applyMatrix4(H_)}var Bs=new O,of=new O,yc=new O,bc=new O,Gs=class{constructor(e=new O,t=new O(0,0,-1)){this.origin=e,this.direction=t}set(e,t){return this.origin.copy(e),this.direction.copy(t),this}copy(e){return this.origin.copy(e.origin),this.direction.copy(e.direction),this}at(e,t){return t.copy(this.origin).addScaledVector(this.direction,e)}lookAt(e){return this.direction.copy(e).sub(this.origin).normalize(),this}recast(e){return this.origin.copy(this.at(e,Bs)),this}closestPointToPoint(e,t){t.subVectors(e,this.origin);let i=t.dot(this.direction);return i<0?t.copy(this.origin):t.copy(this.origin).addScaledVector(this.direction,i)}distanceToPoint(e){return Math.sqrt(this.distanceSqToPoint(e))}distanceSqToPoint(e){let t=Bs.subVectors(e,this.origin).dot(this.direction);return t<0?this.origin.distanceToSquared(e):(Bs.copy(this.origin).addScaledVector(this.direction,t),Bs.distanceToSquared(e))}distanceSqToSegment(e,t,i,s){of.copy(e).add(t).multiplyScalar(.5),yc.copy(t).sub(e).normalize(),bc.copy(this.origin).sub(of);let r=e.distanceTo(t)*.5,o=-this.direction.dot(yc),a=bc.dot(this.direction),l=-bc.dot(yc),c=bc.lengthSq(),u=Math.abs(1-o*o),f,d,p,g;if(u>0)if(f=o*l-a,d=o*a-l,g=r*u,f>=0)if(d>=-g)if(d<=g){let v=1/u;f*=v,d*=v,p=f*(f+o*d+2*a)+d*(o*f+d+2*l)+c}else d=r,f=Math.max(0,-(o*d+a)),p=-f*f+d*(d+2*l)+c;else d=-r,f=Math.max(0,-(o*d+a)),p=-f*f+d*(d+2*l)+c;else d<=-g?(f=Math.max(0,-(-o*r+a)),d=f>0?-r:Math.min(Math.max(-r,-l),r),p=-f*f+d*(d+2*l)+c):d<=g?(f=0,d=Math.min(Math.max(-r,-l),r),p=d*(d+2*l)+c):(f=Math.max(0,-(o*r+a)),d=f>0?r:Math.min(Math.max(-r,-l),r),p=-f*f+d*(d+2*l)+c);else d=o>0?-r:r,f=Math.max(0,-(o*d+a)),p=-f*f+d*(d+2*l)+c;return i&&i.copy(this.origin).addScaledVector(this.direction,f),s&&s.copy(of).addScaledVector(yc,d),p}intersectSphere(e,t){if(e.radius<0)return null;Bs.subVectors(e.center,this.origin);let i=Bs.dot(this.direction),s=Bs.dot(Bs)-i*i,r=e.radius*e.radius;if(s>r)return null;let o=Math.sqrt(r-s),a=i-o,l=i+o;return l<0?null:a<0?this.at(l,t):this.at(a,t)}intersectsSphere(e){return e.radius<0?!1:this.distanceSqToPoint(e.center)<=e.radius*e.radius}distanceToPlane(e){let t=e.normal.dot(this.direction);if(t===0)return e.distanceToPoint(this.origin)===0?0:null;let i=-(this.origin.dot(e.normal)+e.constant)/t;return i>=0?i:null}intersectPlane(e,t){let i=this.distanceToPlane(e);return i===null?null:this.at(i,t)}intersectsPlane(e){let t=e.distanceToPoint(this.origin);return t===0||e.normal.dot(this.direction)*t<0}intersectBox(e,t){let i,s,r,o,a,l,c=1/this.direction.x,u=1/this.direction.y,f=1/this.direction.z,d=this.origin;return c>=0?(i=(e.min.x-d.x)*c,s=(e.max.x-d.x)*c):(i=(e.max.x-d.x)*c,s=(e.min.x-d.x)*c),u>=0?(r=(e.min.y-d.y)*u,o=(e.max.y-d.y)*u):(r=(e.max.y-d.y)*u,o=(e.min.y-d.y)*u),i>o||r>s||((r>i||isNaN(i))&&(i=r),(o<s||isNaN(s))&&(s=o),f>=0?(a=(e.min.z-d.z)*f,l=(e.max.z-d.z)*f):(a=(e.max.z-d.z)*f,l=(e.min.z-d.z)*f),i>l||a>s)||((a>i||i!==i)&&(i=a),(l<s||s!==s)&&(s=l),s<0)?null:this.at(i>=0?i:s,t)}intersectsBox(e){return this.intersectBox(e,Bs)!==null}intersectTriangle(e,t,i,s,r){let o=this.origin,a=this.direction,l=a.x,c=a.y,u=a.z,f=e.x-o.x,d=e.y-o.y,p=e.z-o.z,g=t.x-o.x,v=t.y-o.y,m=t.z-o.z,_=i.x-o.x,x=i.y-o.y,T=i.z-o.z,S=Math.abs(l),R=Math.abs(c),C=Math.abs(u),y,M,N,P,D,z,G,U,W,$,H,le;if(S>=R&&S>=C?(N=l,z=f,W=g,le=_,l>=0?(y=c,M=u,P=d,D=p,G=v,U=m,$=x,H=T):(y=u,M=c,P=p,D=d,G=m,U=v,$=T,H=x)):R>=C?(N=c,z=d,W=v,le=x,c>=0?(y=u,M=l,P=p,D=f,G=m,U=g,$=T,H=_):(y=l,M=u,P=f,D=p,G=g,U=m,$=_,H=T)):(N=u,z=p,W=m,le=T,u>=0?(y=l,M=c,P=f,D=d,G=g,U=v,$=_,H=x):(y=c,M=l,P=d,D=f,G=v,U=g,$=x,H=_)),N===0)return null;let Y=y/N,Q=M/N,ie=1/N,he=P-Y*z,de=D-Q*z,ee=G-Y*W,ge=U-Q*W,xe=$-Y*le,Re=H-Q*le,Me=xe*ge-Re*ee,Ye=he*Re-de*xe,lt=ee*de-ge*he;if(s){if(Me<0||Ye<0||lt<0)return null}else if((Me<0||Ye<0||lt<0)&&(Me>0||Ye>0||lt>0))return null;let We=Me+Ye+lt;if(We===0)return null;let gt=ie*(Me*z+Ye*W+lt*le);return(We>0?gt<0:gt>0)?null:this.at(gt/We,r)}applyMatrix4(e){return this.origin.applyMatrix4(e),this.direction.transformDirection(e),this}equals(e){return e.origin.equals(this.origin)&&e.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}},is=class extends ns{constructor(e){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new it(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new ts,this.combine=Af,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.specularMap=e.specularMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.combine=e.combine,this.reflectivity=e.reflectivity,this.refractionRatio=e.refractionRatio,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.fog=e.fog,this}},Bg=new Et,Ur=new Gs,Sc=new Vi,zg=new O,Mc=new O,wc=new O,Tc=new O,af=new O,Ec=new O,Vg=new O,Ac=new O,Ne=class extends ln{constructor(e=new en,t=new is){super(),this.isMesh=!0,this.type="Mesh",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}getVertexPosition(e,t){let i=this.geometry,s=i.attributes.position,r=i.morphAttributes.position,o=i.morphTargetsRelative;t.fromBufferAttribute(s,e);let a=this.morphTargetInfluences;if(r&&a){Ec.set(0,0,0);for(let l=0,c=r.length;l<c;l++){let u=a[l],f=r[l];u!==0&&(af.fromBufferAttribute(f,e),o?Ec.addScaledVector(af,u):Ec.addScaledVector(af.sub(t),u))}t.add(Ec)}return t}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.material,r=this.matrixWorld;s!==void 0&&(i.boundingSphere===null&&i.computeBoundingSphere(),Sc.copy(i.boundingSphere),Sc.applyMatrix4(r),Ur.copy(e.ray).recast(e.near),!(Sc.containsPoint(Ur.origin)===!1&&(Ur.intersectSphere(Sc,zg)===null||Ur.origin.distanceToSquared(zg)>(e.far-e.near)**2))&&(Bg.copy(r).invert(),Ur.copy(e.ray).applyMatrix4(Bg),!(i.boundingBox!==null&&Ur.intersectsBox(i.boundingBox)===!1)&&this._computeIntersections(e,t,Ur)))}_computeIntersections(e,t,i){let s,r=this.geometry,o=this.material,a=r.index,l=r.attributes.position,c=r.attributes.uv,u=r.attributes.uv1,f=r.attributes.normal,d=r.groups,p=r.drawRange;if(a!==null)if(Array.isArray(o))for(let g=0,v=d.length;g<v;g++){let m=d[g],_=o[m.materialIndex],x=Math.max(m.start,p.start),T=Math.min(a.count,Math.min(m.start+m.count,p.start+p.count));for(let S=x,R=T;S<R;S+=3){let C=a.getX(S),y=a.getX(S+1),M=a.getX(S+2);s=Cc(this,_,e,i,c,u,f,C,y,M),s&&(s.faceIndex=Math.floor(S/3),s.face.materialIndex=m.materialIndex,t.push(s))}}else{let g=Math.max(0,p.start),v=Math.min(a.count,p.start+p.count);for(let m=g,_=v;m<_;m+=3){let x=a.getX(m),T=a.getX(m+1),S=a.getX(m+2);s=Cc(this,o,e,i,c,u,f,x,T,S),s&&(s.faceIndex=Math.floor(m/3),t.push(s))}}else if(l!==void 0)if(Array.isArray(o))for(let g=0,v=d.length;g<v;g++){let m=d[g],_=o[m.materialIndex],x=Math.max(m.start,p.start),T=Math.min(l.count,Math.min(m.start+m.count,p.start+p.count));for(let S=x,R=T;S<R;S+=3){let C=S,y=S+1,M=S+2;s=Cc(this,_,e,i,c,u,f,C,y,M),s&&(s.faceIndex=Math.floor(S/3),s.face.materialIndex=m.materialIndex,t.push(s))}}else{let g=Math.max(0,p.start),v=Math.min(l.count,p.start+p.count);for(let m=g,_=v;m<_;m+=3){let x=m,T=m+1,S=m+2;s=Cc(this,o,e,i,c,u,f,x,T,S),s&&(s.faceIndex=Math.floor(m/3),t.push(s))}}}};function Ib(n,e,t,i,s,r,o,a){let l;if(e.side===pi?l=i.intersectTriangle(o,r,s,!0,a):l=i.intersectTriangle(s,r,o,e.side===xr,a),l===null)return null;Ac.copy(a),Ac.applyMatrix4(n.matrixWorld);let c=t.ray.origin.distanceTo(Ac);return c<t.near||c>t.far?null:{distance:c,point:Ac.clone(),object:n}}function Cc(n,e,t,i,s,r,o,a,l,c){n.getVertexPosition(a,Mc),n.getVertexPosition(l,wc),n.getVertexPosition(c,Tc);let u=Ib(n,e,t,i,Mc,wc,Tc,Vg);if(u){let f=new O;ys.getBarycoord(Vg,Mc,wc,Tc,f),s&&(u.uv=ys.getInterpolatedAttribute(s,a,l,c,f,new Xe)),r&&(u.uv1=ys.getInterpolatedAttribute(r,a,l,c,f,new Xe)),o&&(u.normal=ys.getInterpolatedAttribute(o,a,l,c,f,new O),u.normal.dot(i.direction)>0&&u.normal.multiplyScalar(-1));let d={a,b:l,c,normal:new O,materialIndex:0};ys.getNormal(Mc,wc,Tc,d.normal),u.face=d,u.barycoord=f}return u}var nu=class extends fi{constructor(e=null,t=1,i=1,s,r,o,a,l,c=qn,u=qn,f,d){super(null,o,a,l,c,u,s,r,f,d),this.isDataTexture=!0,this.image={data:e,width:t,height:i},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}};var Or=new Vi,Lb=new Xe(.5,.5),Rc=new O,ur=class{constructor(e=new Ci,t=new Ci,i=new Ci,s=new Ci,r=new Ci,o=new Ci){this.planes=[e,t,i,s,r,o]}set(e,t,i,s,r,o){let a=this.planes;return a[0].copy(e),a[1].copy(t),a[2].copy(i),a[3].copy(s),a[4].copy(r),a[5].copy(o),this}copy(e){let t=this.planes;for(let i=0;i<6;i++)t[i].copy(e.planes[i]);return this}setFromProjectionMatrix(e,t=zi,i=!1){let s=this.planes,r=e.elements,o=r[0],a=r[1],l=r[2],c=r[3],u=r[4],f=r[5],d=r[6],p=r[7],g=r[8],v=r[9],m=r[10],_=r[11],x=r[12],T=r[13],S=r[14],R=r[15];if(s[0].setComponents(c-o,p-u,_-g,R-x).normalize(),s[1].setComponents(c+o,p+u,_+g,R+x).normalize(),s[2].setComponents(c+a,p+f,_+v,R+T).normalize(),s[3].setComponents(c-a,p-f,_-v,R-T).normalize(),i)s[4].setComponents(l,d,m,S).normalize(),s[5].setComponents(c-l,p-d,_-m,R-S).normalize();else if(s[4].setComponents(c-l,p-d,_-m,R-S).normalize(),t===zi)s[5].setComponents(c+l,p+d,_+m,R+S).normalize();else if(t===ko)s[5].setComponents(l,d,m,S).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+t);return this}intersectsObject(e){if(e.boundingSphere!==void 0)e.boundingSphere===null&&e.computeBoundingSphere(),Or.copy(e.boundingSphere).applyMatrix4(e.matrixWorld);else{let t=e.geometry;t.boundingSphere===null&&t.computeBoundingSphere(),Or.copy(t.boundingSphere).applyMatrix4(e.matrixWorld)}return this.intersectsSphere(Or)}intersectsSprite(e){Or.center.set(0,0,0);let t=Lb.distanceTo(e.center);return Or.radius=.7071067811865476+t,Or.applyMatrix4(e.matrixWorld),this.intersectsSphere(Or)}intersectsSphere(e){let t=this.planes,i=e.center,s=-e.radius;for(let r=0;r<6;r++)if(t[r].distanceToPoint(i)<s)return!1;return!0}intersectsBox(e){let t=this.planes;for(let i=0;i<6;i++){let s=t[i];if(Rc.x=s.normal.x>0?e.max.x:e.min.x,Rc.y=s.normal.y>0?e.max.y:e.min.y,Rc.z=s.normal.z>0?e.max.z:e.min.z,s.distanceToPoint(Rc)<0)return!1}return!0}containsPoint(e){let t=this.planes;for(let i=0;i<6;i++)if(t[i].distanceToPoint(e)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}},Gg=new Et,iu=class n{constructor(){this.coordinateSystem=zi,this._frustums=[],this._count=0}setFromArrayCamera(e){let t=e.cameras,i=this._frustums;for(let s=0;s<t.length;s++){let r=t[s];Gg.multiplyMatrices(r.projectionMatrix,r.matrixWorldInverse),i[s]===void 0&&(i[s]=new ur),i[s].setFromProjectionMatrix(Gg,r.coordinateSystem,r.reversedDepth)}return this._count=t.length,this}getFrustum(e){return this._frustums[e]}intersectsObject(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsObject(e))return!0;return!1}intersectsSprite(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSprite(e))return!0;return!1}intersectsSphere(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsSphere(e))return!0;return!1}intersectsBox(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].intersectsBox(e))return!0;return!1}containsPoint(e){let t=this._frustums;for(let i=0;i<this._count;i++)if(t[i].containsPoint(e))return!0;return!1}copy(e){this.coordinateSystem=e.coordinateSystem;let t=this._frustums,i=e._frustums;for(let s=0;s<e._count;s++)t[s]===void 0&&(t[s]=new ur),t[s].copy(i[s]);return this._count=e._count,this}clone(){return new n().copy(this)}};var _i=class extends ns{constructor(e){super(),this.isLineBasicMaterial=!0,this.type="LineBasicMaterial",this.color=new it(16777215),this.map=null,this.linewidth=1,this.linecap="round",this.linejoin="round",this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.linewidth=e.linewidth,this.linecap=e.linecap,this.linejoin=e.linejoin,this.fog=e.fog,this}},su=new O,ru=new O,Hg=new Et,Ba=new Gs,Pc=new Vi,lf=new O,Wg=new O,vi=class extends ln{constructor(e=new en,t=new _i){super(),this.isLine=!0,this.type="Line",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[0];for(let s=1,r=t.count;s<r;s++)su.fromBufferAttribute(t,s-1),ru.fromBufferAttribute(t,s),i[s]=i[s-1],i[s]+=su.distanceTo(ru);e.setAttribute("lineDistance",new Mt(i,1))}else Je("Line.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.matrixWorld,r=e.params.Line.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Pc.copy(i.boundingSphere),Pc.applyMatrix4(s),Pc.radius+=r,e.ray.intersectsSphere(Pc)===!1)return;Hg.copy(s).invert(),Ba.copy(e.ray).applyMatrix4(Hg);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=this.isLineSegments?2:1,u=i.index,d=i.attributes.position;if(u!==null){let p=Math.max(0,o.start),g=Math.min(u.count,o.start+o.count);for(let v=p,m=g-1;v<m;v+=c){let _=u.getX(v),x=u.getX(v+1),T=Ic(this,e,Ba,l,_,x,v);T&&t.push(T)}if(this.isLineLoop){let v=u.getX(g-1),m=u.getX(p),_=Ic(this,e,Ba,l,v,m,g-1);_&&t.push(_)}}else{let p=Math.max(0,o.start),g=Math.min(d.count,o.start+o.count);for(let v=p,m=g-1;v<m;v+=c){let _=Ic(this,e,Ba,l,v,v+1,v);_&&t.push(_)}if(this.isLineLoop){let v=Ic(this,e,Ba,l,g-1,p,g-1);v&&t.push(v)}}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function Ic(n,e,t,i,s,r,o){let a=n.geometry.attributes.position;if(su.fromBufferAttribute(a,s),ru.fromBufferAttribute(a,r),t.distanceSqToSegment(su,ru,lf,Wg)>i)return;lf.applyMatrix4(n.matrixWorld);let c=e.ray.origin.distanceTo(lf);if(!(c<e.near||c>e.far))return{distance:c,point:Wg.clone().applyMatrix4(n.matrixWorld),index:o,face:null,faceIndex:null,barycoord:null,object:n}}var Xg=new O,qg=new O,Fr=class extends vi{constructor(e,t){super(e,t),this.isLineSegments=!0,this.type="LineSegments"}computeLineDistances(){let e=this.geometry;if(e.index===null){let t=e.attributes.position,i=[];for(let s=0,r=t.count;s<r;s+=2)Xg.fromBufferAttribute(t,s),qg.fromBufferAttribute(t,s+1),i[s]=s===0?0:i[s-1],i[s+1]=i[s]+Xg.distanceTo(qg);e.setAttribute("lineDistance",new Mt(i,1))}else Je("LineSegments.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}},Qa=class extends vi{constructor(e,t){super(e,t),this.isLineLoop=!0,this.type="LineLoop"}},Xo=class extends ns{constructor(e){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new it(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.color.copy(e.color),this.map=e.map,this.alphaMap=e.alphaMap,this.size=e.size,this.sizeAttenuation=e.sizeAttenuation,this.fog=e.fog,this}},Yg=new Et,gf=new Gs,Lc=new Vi,Dc=new O,el=class extends ln{constructor(e=new en,t=new Xo){super(),this.isPoints=!0,this.type="Points",this.geometry=e,this.material=t,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(e,t){return super.copy(e,t),e.morphTargetInfluences!==void 0?this.morphTargetInfluences=e.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,e.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},e.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(e.material)?e.material.slice():e.material,this.geometry=e.geometry,this}intersectsFrustum(e){return e.intersectsObject(this)}raycast(e,t){let i=this.geometry,s=this.matrixWorld,r=e.params.Points.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Lc.copy(i.boundingSphere),Lc.applyMatrix4(s),Lc.radius+=r,e.ray.intersectsSphere(Lc)===!1)return;Yg.copy(s).invert(),gf.copy(e.ray).applyMatrix4(Yg);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=i.index,f=i.attributes.position;if(c!==null){let d=Math.max(0,o.start),p=Math.min(c.count,o.start+o.count);for(let g=d,v=p;g<v;g++){let m=c.getX(g);Dc.fromBufferAttribute(f,m),$g(Dc,m,l,s,e,t,this)}}else{let d=Math.max(0,o.start),p=Math.min(f.count,o.start+o.count);for(let g=d,v=p;g<v;g++)Dc.fromBufferAttribute(f,g),$g(Dc,g,l,s,e,t,this)}}updateMorphTargets(){let t=this.geometry.morphAttributes,i=Object.keys(t);if(i.length>0){let s=t[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function $g(n,e,t,i,s,r,o){let a=gf.distanceSqToPoint(n);if(a<t){let l=new O;gf.closestPointToPoint(n,l),l.applyMatrix4(i);let c=s.ray.origin.distanceTo(l);if(c<s.near||c>s.far)return;r.push({distance:c,distanceToRay:Math.sqrt(a),point:l,index:e,face:null,faceIndex:null,barycoord:null,object:o})}}var tl=class extends fi{constructor(e=[],t=Hr,i,s,r,o,a,l,c,u){super(e,t,i,s,r,o,a,l,c,u),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(e){this.image=e}},nl=class extends fi{constructor(e,t,i,s,r,o,a,l,c){super(e,t,i,s,r,o,a,l,c),this.isCanvasTexture=!0,this.needsUpdate=!0}};var Hs=class extends fi{constructor(e,t,i=ss,s,r,o,a=qn,l=qn,c,u=Vs,f=1){if(u!==Vs&&u!==qs)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");let d={width:e,height:t,depth:f};super(d,s,r,o,a,l,u,i,c),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(e){return super.copy(e),this.source=new Vo(Object.assign({},e.image)),this.compareFunction=e.compareFunction,this}toJSON(e){let t=super.toJSON(e);return t.compareFunction=this.compareFunction,t}},il=class extends Hs{constructor(e,t=ss,i=Hr,s,r,o=qn,a=qn,l,c=Vs){let u={width:e,height:e,depth:1},f=[u,u,u,u,u,u];super(e,e,t,i,s,r,o,a,l,c),this.image=f,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(e){this.image=e}},sl=class extends fi{constructor(e=null){super(),this.sourceTexture=e,this.isExternalTexture=!0}copy(e){return super.copy(e),this.sourceTexture=e.sourceTexture,this}},tn=class n extends en{constructor(e=1,t=1,i=1,s=1,r=1,o=1){super(),this.type="BoxGeometry",this.parameters={width:e,height:t,depth:i,widthSegments:s,heightSegments:r,depthSegments:o};let a=this;s=Math.floor(s),r=Math.floor(r),o=Math.floor(o);let l=[],c=[],u=[],f=[],d=0,p=0;g("z","y","x",-1,-1,i,t,e,o,r,0),g("z","y","x",1,-1,i,t,-e,o,r,1),g("x","z","y",1,1,e,i,t,s,o,2),g("x","z","y",1,-1,e,i,-t,s,o,3),g("x","y","z",1,-1,e,t,i,s,r,4),g("x","y","z",-1,-1,e,t,-i,s,r,5),this.setIndex(l),this.setAttribute("position",new Mt(c,3)),this.setAttribute("normal",new Mt(u,3)),this.setAttribute("uv",new Mt(f,2));function g(v,m,_,x,T,S,R,C,y,M,N){let P=S/y,D=R/M,z=S/2,G=R/2,U=C/2,W=y+1,$=M+1,H=0,le=0,Y=new O;for(let Q=0;Q<$;Q++){let ie=Q*D-G;for(let he=0;he<W;he++){let de=he*P-z;Y[v]=de*x,Y[m]=ie*T,Y[_]=U,c.push(Y.x,Y.y,Y.z),Y[v]=0,Y[m]=0,Y[_]=C>0?1:-1,u.push(Y.x,Y.y,Y.z),f.push(he/y),f.push(1-Q/M),H+=1}}for(let Q=0;Q<M;Q++)for(let ie=0;ie<y;ie++){let he=d+ie+W*Q,de=d+ie+W*(Q+1),ee=d+(ie+1)+W*(Q+1),ge=d+(ie+1)+W*Q;l.push(he,de,ge),l.push(de,ee,ge),le+=6}a.addGroup(p,le,N),p+=le,d+=H}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.depth,e.widthSegments,e.heightSegments,e.depthSegments)}};var Cn=class n extends en{constructor(e=1,t=1,i=1,s=32,r=1,o=!1,a=0,l=Math.PI*2){super(),this.type="CylinderGeometry",this.parameters={radiusTop:e,radiusBottom:t,height:i,radialSegments:s,heightSegments:r,openEnded:o,thetaStart:a,thetaLength:l};let c=this;s=Math.floor(s),r=Math.floor(r);let u=[],f=[],d=[],p=[],g=0,v=[],m=i/2,_=0;x(),o===!1&&(e>0&&T(!0),t>0&&T(!1)),this.setIndex(u),this.setAttribute("position",new Mt(f,3)),this.setAttribute("normal",new Mt(d,3)),this.setAttribute("uv",new Mt(p,2));function x(){let S=new O,R=new O,C=0,y=(t-e)/i;for(let M=0;M<=r;M++){let N=[],P=M/r,D=P*(t-e)+e;for(let z=0;z<=s;z++){let G=z/s,U=G*l+a,W=Math.sin(U),$=Math.cos(U);R.x=D*W,R.y=-P*i+m,R.z=D*$,f.push(R.x,R.y,R.z),S.set(W,y,$).normalize(),d.push(S.x,S.y,S.z),p.push(G,1-P),N.push(g++)}v.push(N)}for(let M=0;M<s;M++)for(let N=0;N<r;N++){let P=v[N][M],D=v[N+1][M],z=v[N+1][M+1],G=v[N][M+1];(e>0||N!==0)&&(u.push(P,D,G),C+=3),(t>0||N!==r-1)&&(u.push(D,z,G),C+=3)}c.addGroup(_,C,0),_+=C}function T(S){let R=g,C=new Xe,y=new O,M=0,N=S===!0?e:t,P=S===!0?1:-1;for(let z=1;z<=s;z++)f.push(0,m*P,0),d.push(0,P,0),p.push(.5,.5),g++;let D=g;for(let z=0;z<=s;z++){let U=z/s*l+a,W=Math.cos(U),$=Math.sin(U);y.x=N*$,y.y=m*P,y.z=N*W,f.push(y.x,y.y,y.z),d.push(0,P,0),C.x=W*.5+.5,C.y=$*.5*P+.5,p.push(C.x,C.y),g++}for(let z=0;z<s;z++){let G=R+z,U=D+z;S===!0?u.push(U,U+1,G):u.push(U+1,U,G),M+=3}c.addGroup(_,M,S===!0?1:2),_+=M}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radiusTop,e.radiusBottom,e.height,e.radialSegments,e.heightSegments,e.openEnded,e.thetaStart,e.thetaLength)}};var ou=class n extends en{constructor(e=[],t=[],i=1,s=0){super(),this.type="PolyhedronGeometry",this.parameters={vertices:e,indices:t,radius:i,detail:s};let r=[],o=[];a(s),c(i),u(),this.setAttribute("position",new Mt(r,3)),this.setAttribute("normal",new Mt(r.slice(),3)),this.setAttribute("uv",new Mt(o,2)),s===0?this.computeVertexNormals():this.normalizeNormals();function a(x){let T=new O,S=new O,R=new O;for(let C=0;C<t.length;C+=3)p(t[C+0],T),p(t[C+1],S),p(t[C+2],R),l(T,S,R,x)}function l(x,T,S,R){let C=R+1,y=[];for(let M=0;M<=C;M++){y[M]=[];let N=x.clone().lerp(S,M/C),P=T.clone().lerp(S,M/C),D=C-M;for(let z=0;z<=D;z++)z===0&&M===C?y[M][z]=N:y[M][z]=N.clone().lerp(P,z/D)}for(let M=0;M<C;M++)for(let N=0;N<2*(C-M)-1;N++){let P=Math.floor(N/2);N%2===0?(d(y[M][P+1]),d(y[M+1][P]),d(y[M][P])):(d(y[M][P+1]),d(y[M+1][P+1]),d(y[M+1][P]))}}function c(x){let T=new O;for(let S=0;S<r.length;S+=3)T.x=r[S+0],T.y=r[S+1],T.z=r[S+2],T.normalize().multiplyScalar(x),r[S+0]=T.x,r[S+1]=T.y,r[S+2]=T.z}function u(){let x=new O;for(let T=0;T<r.length;T+=3){x.x=r[T+0],x.y=r[T+1],x.z=r[T+2];let S=m(x)/2/Math.PI+.5,R=_(x)/Math.PI+.5;o.push(S,1-R)}g(),f()}function f(){for(let x=0;x<o.length;x+=6){let T=o[x+0],S=o[x+2],R=o[x+4],C=Math.max(T,S,R),y=Math.min(T,S,R);C>.9&&y<.1&&(T<.2&&(o[x+0]+=1),S<.2&&(o[x+2]+=1),R<.2&&(o[x+4]+=1))}}function d(x){r.push(x.x,x.y,x.z)}function p(x,T){let S=x*3;T.x=e[S+0],T.y=e[S+1],T.z=e[S+2]}function g(){let x=new O,T=new O,S=new O,R=new O,C=new Xe,y=new Xe,M=new Xe;for(let N=0,P=0;N<r.length;N+=9,P+=6){x.set(r[N+0],r[N+1],r[N+2]),T.set(r[N+3],r[N+4],r[N+5]),S.set(r[N+6],r[N+7],r[N+8]),C.set(o[P+0],o[P+1]),y.set(o[P+2],o[P+3]),M.set(o[P+4],o[P+5]),R.copy(x).add(T).add(S).divideScalar(3);let D=m(R);v(C,P+0,x,D),v(y,P+2,T,D),v(M,P+4,S,D)}}function v(x,T,S,R){R<0&&x.x===1&&(o[T]=x.x-1),S.x===0&&S.z===0&&(o[T]=R/2/Math.PI+.5)}function m(x){return Math.atan2(x.z,-x.x)}function _(x){return Math.atan2(-x.y,Math.sqrt(x.x*x.x+x.z*x.z))}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.vertices,e.indices,e.radius,e.detail)}};var Nc=new O,Uc=new O,cf=new O,Oc=new ys,rl=class extends en{constructor(e=null,t=1){if(super(),this.type="EdgesGeometry",this.parameters={geometry:e,thresholdAngle:t},e!==null){let s=Math.pow(10,4),r=Math.cos(Uo*t),o=e.getIndex(),a=e.getAttribute("position"),l=o?o.count:a.count,c=[0,0,0],u=["a","b","c"],f=new Array(3),d=new Map,p=[];for(let g=0;g<l;g+=3){o?(c[0]=o.getX(g),c[1]=o.getX(g+1),c[2]=o.getX(g+2)):(c[0]=g,c[1]=g+1,c[2]=g+2);let{a:v,b:m,c:_}=Oc;if(v.fromBufferAttribute(a,c[0]),m.fromBufferAttribute(a,c[1]),_.fromBufferAttribute(a,c[2]),Oc.getNormal(cf),f[0]=`${Math.round(v.x*s)},${Math.round(v.y*s)},${Math.round(v.z*s)}`,f[1]=`${Math.round(m.x*s)},${Math.round(m.y*s)},${Math.round(m.z*s)}`,f[2]=`${Math.round(_.x*s)},${Math.round(_.y*s)},${Math.round(_.z*s)}`,!(f[0]===f[1]||f[1]===f[2]||f[2]===f[0]))for(let x=0;x<3;x++){let T=(x+1)%3,S=f[x],R=f[T],C=Oc[u[x]],y=Oc[u[T]],M=`${S}_${R}`,N=`${R}_${S}`,P=d.get(N);P?(cf.dot(P.normal)<=r&&(p.push(C.x,C.y,C.z),p.push(y.x,y.y,y.z)),d.set(N,null)):d.has(M)||d.set(M,{index0:c[x],index1:c[T],normal:cf.clone()})}}for(let g of d.values())if(g){let{index0:v,index1:m}=g;Nc.fromBufferAttribute(a,v),Uc.fromBufferAttribute(a,m),p.push(Nc.x,Nc.y,Nc.z),p.push(Uc.x,Uc.y,Uc.z)}this.setAttribute("position",new Mt(p,3))}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}};var hr=class n extends ou{constructor(e=1,t=0){let i=[1,0,0,-1,0,0,0,1,0,0,-1,0,0,0,1,0,0,-1],s=[0,2,4,0,4,3,0,3,5,0,5,2,1,2,5,1,5,3,1,3,4,1,4,2];super(i,s,e,t),this.type="OctahedronGeometry",this.parameters={radius:e,detail:t}}static fromJSON(e){return new n(e.radius,e.detail)}},kr=class n extends en{constructor(e=1,t=1,i=1,s=1){super(),this.type="PlaneGeometry",this.parameters={width:e,height:t,widthSegments:i,heightSegments:s};let r=e/2,o=t/2,a=Math.floor(i),l=Math.floor(s),c=a+1,u=l+1,f=e/a,d=t/l,p=[],g=[],v=[],m=[];for(let _=0;_<u;_++){let x=_*d-o;for(let T=0;T<c;T++){let S=T*f-r;g.push(S,-x,0),v.push(0,0,1),m.push(T/a),m.push(1-_/l)}}for(let _=0;_<l;_++)for(let x=0;x<a;x++){let T=x+c*_,S=x+c*(_+1),R=x+1+c*(_+1),C=x+1+c*_;p.push(T,S,C),p.push(S,R,C)}this.setIndex(p),this.setAttribute("position",new Mt(g,3)),this.setAttribute("normal",new Mt(v,3)),this.setAttribute("uv",new Mt(m,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.width,e.height,e.widthSegments,e.heightSegments)}};var dr=class n extends en{constructor(e=1,t=32,i=16,s=0,r=Math.PI*2,o=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:e,widthSegments:t,heightSegments:i,phiStart:s,phiLength:r,thetaStart:o,thetaLength:a},t=Math.max(3,Math.floor(t)),i=Math.max(2,Math.floor(i));let l=Math.min(o+a,Math.PI),c=0,u=[],f=new O,d=new O,p=[],g=[],v=[],m=[];for(let _=0;_<=i;_++){let x=[],T=_/i,S=o+T*a,R=e*Math.cos(S),C=Math.sqrt(e*e-R*R),y=0;_===0&&o===0?y=.5/t:_===i&&l===Math.PI&&(y=-.5/t);for(let M=0;M<=t;M++){let N=M/t,P=s+N*r;f.x=-C*Math.cos(P),f.y=R,f.z=C*Math.sin(P),g.push(f.x,f.y,f.z),d.copy(f).normalize(),v.push(d.x,d.y,d.z),m.push(N+y,1-T),x.push(c++)}u.push(x)}for(let _=0;_<i;_++)for(let x=0;x<t;x++){let T=u[_][x+1],S=u[_][x],R=u[_+1][x],C=u[_+1][x+1];(_!==0||o>0)&&p.push(T,S,C),(_!==i-1||l<Math.PI)&&p.push(S,R,C)}this.setIndex(p),this.setAttribute("position",new Mt(g,3)),this.setAttribute("normal",new Mt(v,3)),this.setAttribute("uv",new Mt(m,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.widthSegments,e.heightSegments,e.phiStart,e.phiLength,e.thetaStart,e.thetaLength)}};var Ws=class n extends en{constructor(e=1,t=.4,i=12,s=48,r=Math.PI*2,o=0,a=Math.PI*2){super(),this.type="TorusGeometry",this.parameters={radius:e,tube:t,radialSegments:i,tubularSegments:s,arc:r,thetaStart:o,thetaLength:a},i=Math.floor(i),s=Math.floor(s);let l=[],c=[],u=[],f=[],d=new O,p=new O,g=new O;for(let v=0;v<=i;v++){let m=o+v/i*a;for(let _=0;_<=s;_++){let x=_/s*r;p.x=(e+t*Math.cos(m))*Math.cos(x),p.y=(e+t*Math.cos(m))*Math.sin(x),p.z=t*Math.sin(m),c.push(p.x,p.y,p.z),d.x=e*Math.cos(x),d.y=e*Math.sin(x),g.subVectors(p,d).normalize(),u.push(g.x,g.y,g.z),f.push(_/s),f.push(v/i)}}for(let v=1;v<=i;v++)for(let m=1;m<=s;m++){let _=(s+1)*v+m-1,x=(s+1)*(v-1)+m-1,T=(s+1)*(v-1)+m,S=(s+1)*v+m;l.push(_,x,S),l.push(x,T,S)}this.setIndex(l),this.setAttribute("position",new Mt(c,3)),this.setAttribute("normal",new Mt(u,3)),this.setAttribute("uv",new Mt(f,2))}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}static fromJSON(e){return new n(e.radius,e.tube,e.radialSegments,e.tubularSegments,e.arc,e.thetaStart,e.thetaLength)}};var Br=class extends en{constructor(e=null){if(super(),this.type="WireframeGeometry",this.parameters={geometry:e},e!==null){let t=[],i=new Set,s=new O,r=new O;if(e.index!==null){let o=e.attributes.position,a=e.index,l=e.groups;l.length===0&&(l=[{start:0,count:a.count,materialIndex:0}]);for(let c=0,u=l.length;c<u;++c){let f=l[c],d=f.start,p=f.count;for(let g=d,v=d+p;g<v;g+=3)for(let m=0;m<3;m++){let _=a.getX(g+m),x=a.getX(g+(m+1)%3);s.fromBufferAttribute(o,_),r.fromBufferAttribute(o,x),Zg(s,r,i)===!0&&(t.push(s.x,s.y,s.z),t.push(r.x,r.y,r.z))}}}else{let o=e.attributes.position;for(let a=0,l=o.count/3;a<l;a++)for(let c=0;c<3;c++){let u=3*a+c,f=3*a+(c+1)%3;s.fromBufferAttribute(o,u),r.fromBufferAttribute(o,f),Zg(s,r,i)===!0&&(t.push(s.x,s.y,s.z),t.push(r.x,r.y,r.z))}}this.setAttribute("position",new Mt(t,3))}}copy(e){return super.copy(e),this.parameters=Object.assign({},e.parameters),this}};function Zg(n,e,t){let i=`${n.x},${n.y},${n.z}-${e.x},${e.y},${e.z}`,s=`${e.x},${e.y},${e.z}-${n.x},${n.y},${n.z}`;return t.has(i)===!0||t.has(s)===!0?!1:(t.add(i),t.add(s),!0)}function Xr(n){let e={};for(let t in n){e[t]={};for(let i in n[t]){let s=n[t][i];if(Jg(s))s.isRenderTargetTexture?(Je("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),e[t][i]=null):e[t][i]=s.clone();else if(Array.isArray(s))if(Jg(s[0])){let r=[];for(let o=0,a=s.length;o<a;o++)r[o]=s[o].clone();e[t][i]=r}else e[t][i]=s.slice();else e[t][i]=s}}return e}function ni(n){let e={};for(let t=0;t<n.length;t++){let i=Xr(n[t]);for(let s in i)e[s]=i[s]}return e}function Jg(n){return n&&(n.isColor||n.isMatrix3||n.isMatrix4||n.isVector2||n.isVector3||n.isVector4||n.isTexture||n.isQuaternion)}function Db(n){let e=[];for(let t=0;t<n.length;t++)e.push(n[t].clone());return e}function jf(n){let e=n.getRenderTarget();return e===null?n.outputColorSpace:e.isXRRenderTarget===!0?e.texture.colorSpace:St.workingColorSpace}var Tl={clone:Xr,merge:ni},Nb=`void main() {
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}`,Ub=`void main() {
	gl_FragColor = vec4( 1.0, 0.0, 0.0, 1.0 );
}`,Gi=class extends ns{constructor(e){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=Nb,this.fragmentShader=Ub,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,e!==void 0&&this.setValues(e)}copy(e){return super.copy(e),this.fragmentShader=e.fragmentShader,this.vertexShader=e.vertexShader,this.uniforms=Xr(e.uniforms),this.uniformsGroups=Db(e.uniformsGroups),this.defines=Object.assign({},e.defines),this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.fog=e.fog,this.lights=e.lights,this.clipping=e.clipping,this.extensions=Object.assign({},e.extensions),this.glslVersion=e.glslVersion,this.defaultAttributeValues=Object.assign({},e.defaultAttributeValues),this.index0AttributeName=e.index0AttributeName,this.uniformsNeedUpdate=e.uniformsNeedUpdate,this}toJSON(e){let t=super.toJSON(e);t.glslVersion=this.glslVersion,t.uniforms={};for(let s in this.uniforms){let o=this.uniforms[s].value;o&&o.isTexture?t.uniforms[s]={type:"t",value:o.toJSON(e).uuid}:o&&o.isColor?t.uniforms[s]={type:"c",value:o.getHex()}:o&&o.isVector2?t.uniforms[s]={type:"v2",value:o.toArray()}:o&&o.isVector3?t.uniforms[s]={type:"v3",value:o.toArray()}:o&&o.isVector4?t.uniforms[s]={type:"v4",value:o.toArray()}:o&&o.isMatrix3?t.uniforms[s]={type:"m3",value:o.toArray()}:o&&o.isMatrix4?t.uniforms[s]={type:"m4",value:o.toArray()}:t.uniforms[s]={value:o}}Object.keys(this.defines).length>0&&(t.defines=this.defines),t.vertexShader=this.vertexShader,t.fragmentShader=this.fragmentShader,t.lights=this.lights,t.clipping=this.clipping;let i={};for(let s in this.extensions)this.extensions[s]===!0&&(i[s]=!0);return Object.keys(i).length>0&&(t.extensions=i),t}fromJSON(e,t){if(super.fromJSON(e,t),e.uniforms!==void 0)for(let i in e.uniforms){let s=e.uniforms[i];switch(this.uniforms[i]={},s.type){case"t":this.uniforms[i].value=t[s.value]||null;break;case"c":this.uniforms[i].value=new it().setHex(s.value);break;case"v2":this.uniforms[i].value=new Xe().fromArray(s.value);break;case"v3":this.uniforms[i].value=new O().fromArray(s.value);break;case"v4":this.uniforms[i].value=new Nt().fromArray(s.value);break;case"m3":this.uniforms[i].value=new st().fromArray(s.value);break;case"m4":this.uniforms[i].value=new Et().fromArray(s.value);break;default:this.uniforms[i].value=s.value}}if(e.defines!==void 0&&(this.defines=e.defines),e.vertexShader!==void 0&&(this.vertexShader=e.vertexShader),e.fragmentShader!==void 0&&(this.fragmentShader=e.fragmentShader),e.glslVersion!==void 0&&(this.glslVersion=e.glslVersion),e.extensions!==void 0)for(let i in e.extensions)this.extensions[i]=e.extensions[i];return e.lights!==void 0&&(this.lights=e.lights),e.clipping!==void 0&&(this.clipping=e.clipping),this}},au=class extends Gi{constructor(e){super(e),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}},qo=class extends ns{constructor(e){super(),this.isMeshStandardMaterial=!0,this.type="MeshStandardMaterial",this.defines={STANDARD:""},this.color=new it(16777215),this.roughness=1,this.metalness=0,this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new it(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=ah,this.normalScale=new Xe(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.roughnessMap=null,this.metalnessMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new ts,this.envMapIntensity=1,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(e)}copy(e){return super.copy(e),this.defines={STANDARD:""},this.color.copy(e.color),this.roughness=e.roughness,this.metalness=e.metalness,this.map=e.map,this.lightMap=e.lightMap,this.lightMapIntensity=e.lightMapIntensity,this.aoMap=e.aoMap,this.aoMapIntensity=e.aoMapIntensity,this.emissive.copy(e.emissive),this.emissiveMap=e.emissiveMap,this.emissiveIntensity=e.emissiveIntensity,this.bumpMap=e.bumpMap,this.bumpScale=e.bumpScale,this.normalMap=e.normalMap,this.normalMapType=e.normalMapType,this.normalScale.copy(e.normalScale),this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.roughnessMap=e.roughnessMap,this.metalnessMap=e.metalnessMap,this.alphaMap=e.alphaMap,this.envMap=e.envMap,this.envMapRotation.copy(e.envMapRotation),this.envMapIntensity=e.envMapIntensity,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this.wireframeLinecap=e.wireframeLinecap,this.wireframeLinejoin=e.wireframeLinejoin,this.flatShading=e.flatShading,this.fog=e.fog,this}};var lu=class extends ns{constructor(e){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=P_,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(e)}copy(e){return super.copy(e),this.depthPacking=e.depthPacking,this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this.wireframe=e.wireframe,this.wireframeLinewidth=e.wireframeLinewidth,this}},cu=class extends ns{constructor(e){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(e)}copy(e){return super.copy(e),this.map=e.map,this.alphaMap=e.alphaMap,this.displacementMap=e.displacementMap,this.displacementScale=e.displacementScale,this.displacementBias=e.displacementBias,this}};var ol=class extends _i{constructor(e){super(),this.isLineDashedMaterial=!0,this.type="LineDashedMaterial",this.scale=1,this.dashSize=3,this.gapSize=1,this.setValues(e)}copy(e){return super.copy(e),this.scale=e.scale,this.dashSize=e.dashSize,this.gapSize=e.gapSize,this}};function Po(n,e){return!n||n.constructor===e?n:typeof e.BYTES_PER_ELEMENT=="number"?new e(n):Array.prototype.slice.call(n)}function Fc(n){return n!==void 0&&n.inTangents!==void 0&&n.outTangents!==void 0}var fr=class{constructor(e,t,i,s){this.parameterPositions=e,this._cachedIndex=0,this.resultBuffer=s!==void 0?s:new t.constructor(i),this.sampleValues=t,this.valueSize=i,this.settings=null,this.DefaultSettings_={}}evaluate(e){let t=this.parameterPositions,i=this._cachedIndex,s=t[i],r=t[i-1];e:{t:{let o;n:{i:if(!(e<s)){for(let a=i+2;;){if(s===void 0){if(e<r)break i;return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}if(i===a)break;if(r=s,s=t[++i],e<s)break t}o=t.length;break n}if(!(e>=r)){let a=t[1];e<a&&(i=2,r=a);for(let l=i-2;;){if(r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(i===l)break;if(s=r,r=t[--i-1],e>=r)break t}o=i,i=0;break n}break e}for(;i<o;){let a=i+o>>>1;e<t[a]?o=a:i=a+1}if(s=t[i],r=t[i-1],r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(s===void 0)return i=t.length,this._cachedIndex=i,this.copySampleValue_(i-1)}this._cachedIndex=i,this.intervalChanged_(i,r,s)}return this.interpolate_(i,r,e,s)}getSettings_(){return this.settings||this.DefaultSettings_}copySampleValue_(e){let t=this.resultBuffer,i=this.sampleValues,s=this.valueSize,r=e*s;for(let o=0;o!==s;++o)t[o]=i[r+o];return t}interpolate_(){throw new Error("THREE.Interpolant: Call to abstract method.")}intervalChanged_(){}},uu=class extends fr{constructor(e,t,i,s){super(e,t,i,s),this._weightPrev=-0,this._offsetPrev=-0,this._weightNext=-0,this._offsetNext=-0,this.DefaultSettings_={endingStart:ff,endingEnd:ff}}intervalChanged_(e,t,i){let s=this.parameterPositions,r=e-2,o=e+1,a=s[r],l=s[o];if(a===void 0)switch(this.getSettings_().endingStart){case pf:r=e,a=2*t-i;break;case mf:r=s.length-2,a=t+s[r]-s[r+1];break;default:r=e,a=i}if(l===void 0)switch(this.getSettings_().endingEnd){case pf:o=e,l=2*i-t;break;case mf:o=1,l=i+s[1]-s[0];break;default:o=e-1,l=t}let c=(i-t)*.5,u=this.valueSize;this._weightPrev=c/(t-a),this._weightNext=c/(l-i),this._offsetPrev=r*u,this._offsetNext=o*u}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this._offsetPrev,f=this._offsetNext,d=this._weightPrev,p=this._weightNext,g=(i-t)/(s-t),v=g*g,m=v*g,_=-d*m+2*d*v-d*g,x=(1+d)*m+(-1.5-2*d)*v+(-.5+d)*g+1,T=(-1-p)*m+(1.5+p)*v+.5*g,S=p*m-p*v;for(let R=0;R!==a;++R)r[R]=_*o[u+R]+x*o[c+R]+T*o[l+R]+S*o[f+R];return r}},hu=class extends fr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=(i-t)/(s-t),f=1-u;for(let d=0;d!==a;++d)r[d]=o[c+d]*f+o[l+d]*u;return r}},du=class extends fr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e){return this.copySampleValue_(e-1)}},fu=class extends fr{interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=e*a,c=l-a,u=this.inTangents,f=this.outTangents;if(!u||!f){let g=(i-t)/(s-t),v=1-g;for(let m=0;m!==a;++m)r[m]=o[c+m]*v+o[l+m]*g;return r}let d=a*2,p=e-1;for(let g=0;g!==a;++g){let v=o[c+g],m=o[l+g],_=p*d+g*2,x=f[_],T=f[_+1],S=e*d+g*2,R=u[S],C=u[S+1],y=Fb(i,t,x,R,s);r[g]=W_(y,v,T,C,m)}return r}};function W_(n,e,t,i,s){let r=1-n;return r*r*r*e+3*r*r*n*t+3*r*n*n*i+n*n*n*s}function Ob(n,e,t,i,s){let r=1-n;return 3*r*r*(t-e)+6*r*n*(i-t)+3*n*n*(s-i)}function Fb(n,e,t,i,s){let r=(n-e)/(s-e);for(let o=0;o<8;o++){let a=W_(r,e,t,i,s)-n;if(Math.abs(a)<1e-10)break;let l=Ob(r,e,t,i,s);if(Math.abs(l)<1e-10)break;r=Math.max(0,Math.min(1,r-a/l))}return r}var Li=class{constructor(e,t,i,s){if(e===void 0)throw new Error("THREE.KeyframeTrack: track name is undefined");if(t===void 0||t.length===0)throw new Error("THREE.KeyframeTrack: no keyframes in track named "+e);this.name=e,this.times=Po(t,this.TimeBufferType),this.values=Po(i,this.ValueBufferType),this.setInterpolation(s||this.DefaultInterpolation)}static toJSON(e){let t=e.constructor,i;if(t.toJSON!==this.toJSON)i=t.toJSON(e);else{i={name:e.name,times:Po(e.times,Array),values:Po(e.values,Array)};let s=e.getInterpolation();s!==e.DefaultInterpolation&&(i.interpolation=s),Fc(e.settings)&&(i.settings={inTangents:Po(e.settings.inTangents,Array),outTangents:Po(e.settings.outTangents,Array)})}return i.type=e.ValueTypeName,i}InterpolantFactoryMethodDiscrete(e){return new du(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodLinear(e){return new hu(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodSmooth(e){return new uu(this.times,this.values,this.getValueSize(),e)}InterpolantFactoryMethodBezier(e){let t=new fu(this.times,this.values,this.getValueSize(),e);return this.settings&&(t.inTangents=this.settings.inTangents,t.outTangents=this.settings.outTangents),t}setInterpolation(e){let t;switch(e){case Ga:t=this.InterpolantFactoryMethodDiscrete;break;case jc:t=this.InterpolantFactoryMethodLinear;break;case Vc:t=this.InterpolantFactoryMethodSmooth;break;case df:t=this.InterpolantFactoryMethodBezier;break}if(t===void 0){let i="unsupported interpolation for "+this.ValueTypeName+" keyframe track named "+this.name;if(this.createInterpolant===void 0)if(e!==this.DefaultInterpolation)this.setInterpolation(this.DefaultInterpolation);else throw new Error(i);return Je("KeyframeTrack:",i),this}return this.createInterpolant=t,this}getInterpolation(){switch(this.createInterpolant){case this.InterpolantFactoryMethodDiscrete:return Ga;case this.InterpolantFactoryMethodLinear:return jc;case this.InterpolantFactoryMethodSmooth:return Vc;case this.InterpolantFactoryMethodBezier:return df}}getValueSize(){return this.values.length/this.times.length}shift(e){if(e!==0){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]+=e;Fc(this.settings)&&(Kg(this.settings.inTangents,e),Kg(this.settings.outTangents,e))}return this}scale(e){if(e!==1){let t=this.times;for(let i=0,s=t.length;i!==s;++i)t[i]*=e;Fc(this.settings)&&(jg(this.settings.inTangents,e),jg(this.settings.outTangents,e))}return this}trim(e,t){let i=this.times,s=i.length,r=0,o=s-1;for(;r!==s&&i[r]<e;)++r;for(;o!==-1&&i[o]>t;)--o;if(++o,r!==0||o!==s){r>=o&&(o=Math.max(o,1),r=o-1);let a=this.getValueSize();this.times=i.slice(r,o),this.values=this.values.slice(r*a,o*a)}return this}validate(){let e=!0,t=this.getValueSize();t-Math.floor(t)!==0&&(Qe("KeyframeTrack: Invalid value size in track.",this),e=!1);let i=this.times,s=this.values,r=i.length;r===0&&(Qe("KeyframeTrack: Track is empty.",this),e=!1);let o=null;for(let a=0;a!==r;a++){let l=i[a];if(typeof l=="number"&&isNaN(l)){Qe("KeyframeTrack: Time is not a valid number.",this,a,l),e=!1;break}if(o!==null&&o>l){Qe("KeyframeTrack: Out of order keys.",this,a,l,o),e=!1;break}o=l}if(s!==void 0&&Qy(s))for(let a=0,l=s.length;a!==l;++a){let c=s[a];if(isNaN(c)){Qe("KeyframeTrack: Value is not a valid number.",this,a,c),e=!1;break}}return e}optimize(){let e=this.times.slice(),t=this.values.slice(),i=this.getValueSize(),s=this.getInterpolation()===Vc,r=e.length-1,o=1;for(let a=1;a<r;++a){let l=!1,c=e[a],u=e[a+1];if(c!==u&&(a!==1||c!==e[0]))if(s)l=!0;else{let f=a*i,d=f-i,p=f+i;for(let g=0;g!==i;++g){let v=t[f+g];if(v!==t[d+g]||v!==t[p+g]){l=!0;break}}}if(l){if(a!==o){e[o]=e[a];let f=a*i,d=o*i;for(let p=0;p!==i;++p)t[d+p]=t[f+p]}++o}}if(r>0){e[o]=e[r];for(let a=r*i,l=o*i,c=0;c!==i;++c)t[l+c]=t[a+c];++o}return o!==e.length?(this.times=e.slice(0,o),this.values=t.slice(0,o*i)):(this.times=e,this.values=t),this}clone(){let e=this.times.slice(),t=this.values.slice(),i=this.constructor,s=new i(this.name,e,t);return s.createInterpolant=this.createInterpolant,Fc(this.settings)&&(s.settings={inTangents:this.settings.inTangents.slice(),outTangents:this.settings.outTangents.slice()}),s}};function Kg(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]+=e}function jg(n,e){for(let t=0,i=n.length;t!==i;t+=2)n[t]*=e}Li.prototype.ValueTypeName="";Li.prototype.TimeBufferType=Float32Array;Li.prototype.ValueBufferType=Float32Array;Li.prototype.DefaultInterpolation=jc;var pr=class extends Li{constructor(e,t,i){super(e,t,i)}};pr.prototype.ValueTypeName="bool";pr.prototype.ValueBufferType=Array;pr.prototype.DefaultInterpolation=Ga;pr.prototype.InterpolantFactoryMethodLinear=void 0;pr.prototype.InterpolantFactoryMethodSmooth=void 0;var pu=class extends Li{constructor(e,t,i,s){super(e,t,i,s)}};pu.prototype.ValueTypeName="color";var mu=class extends Li{constructor(e,t,i,s){super(e,t,i,s)}};mu.prototype.ValueTypeName="number";var gu=class extends fr{constructor(e,t,i,s){super(e,t,i,s)}interpolate_(e,t,i,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=(i-t)/(s-t),c=e*a;for(let u=c+a;c!==u;c+=4)zt.slerpFlat(r,0,o,c-a,o,c,l);return r}},al=class extends Li{constructor(e,t,i,s){super(e,t,i,s)}InterpolantFactoryMethodLinear(e){return new gu(this.times,this.values,this.getValueSize(),e)}};al.prototype.ValueTypeName="quaternion";al.prototype.InterpolantFactoryMethodSmooth=void 0;var mr=class extends Li{constructor(e,t,i){super(e,t,i)}};mr.prototype.ValueTypeName="string";mr.prototype.ValueBufferType=Array;mr.prototype.DefaultInterpolation=Ga;mr.prototype.InterpolantFactoryMethodLinear=void 0;mr.prototype.InterpolantFactoryMethodSmooth=void 0;var _u=class extends Li{constructor(e,t,i,s){super(e,t,i,s)}};_u.prototype.ValueTypeName="vector";var vu=class{constructor(e,t,i){let s=this,r=!1,o=0,a=0,l,c=[];this.onStart=void 0,this.onLoad=e,this.onProgress=t,this.onError=i,this._abortController=null,this.itemStart=function(u){a++,r===!1&&s.onStart!==void 0&&s.onStart(u,o,a),r=!0},this.itemEnd=function(u){o++,s.onProgress!==void 0&&s.onProgress(u,o,a),o===a&&(r=!1,s.onLoad!==void 0&&s.onLoad())},this.itemError=function(u){s.onError!==void 0&&s.onError(u)},this.resolveURL=function(u){return u=u.normalize("NFC"),l?l(u):u},this.setURLModifier=function(u){return l=u,this},this.addHandler=function(u,f){return c.push(u,f),this},this.removeHandler=function(u){let f=c.indexOf(u);return f!==-1&&c.splice(f,2),this},this.getHandler=function(u){for(let f=0,d=c.length;f<d;f+=2){let p=c[f],g=c[f+1];if(p.global&&(p.lastIndex=0),p.test(u))return g}return null},this.abort=function(){return this.abortController.abort(),this._abortController=null,this}}get abortController(){return this._abortController||(this._abortController=new AbortController),this._abortController}},X_=new vu,xu=class{constructor(e){this.manager=e!==void 0?e:X_,this.crossOrigin="anonymous",this.withCredentials=!1,this.path="",this.resourcePath="",this.requestHeader={},this.priority="auto",this.cache="default",typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}load(){}loadAsync(e,t){let i=this;return new Promise(function(s,r){i.load(e,s,t,r)})}parse(){}setCrossOrigin(e){return this.crossOrigin=e,this}setWithCredentials(e){return this.withCredentials=e,this}setPath(e){return this.path=e,this}setResourcePath(e){return this.resourcePath=e,this}setRequestHeader(e){return this.requestHeader=e,this}setPriority(e){return this.priority=e,this}setCache(e){return this.cache=e,this}abort(){return this}};xu.DEFAULT_MATERIAL_NAME="__DEFAULT";var ll=class extends ln{static registerNode(e){this.prototype._lightNode=e}constructor(e,t=1){super(),this.isLight=!0,this.type="Light",this.color=new it(e),this.intensity=t}copy(e,t){return super.copy(e,t),this.color.copy(e.color),this.intensity=e.intensity,this}toJSON(e){let t=super.toJSON(e);return t.object.color=this.color.getHex(),t.object.intensity=this.intensity,t}},cl=class extends ll{constructor(e,t,i){super(e,i),this.isHemisphereLight=!0,this.type="HemisphereLight",this.position.copy(ln.DEFAULT_UP),this.updateMatrix(),this.groundColor=new it(t)}copy(e,t){return super.copy(e,t),this.groundColor.copy(e.groundColor),this}toJSON(e){let t=super.toJSON(e);return t.object.groundColor=this.groundColor.getHex(),t}},uf=new Et,Qg=new O,e_=new O,yu=class{constructor(e){this.camera=e,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new Xe(512,512),this.mapType=yi,this.map=null,this.mapPass=null,this.matrix=new Et,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new ur,this._frameExtents=new Xe(1,1),this._viewportCount=1,this._viewports=[new Nt(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(e){let t=this.camera;Qg.setFromMatrixPosition(e.matrixWorld),t.position.copy(Qg),e_.setFromMatrixPosition(e.target.matrixWorld),t.lookAt(e_),t.updateMatrixWorld(),this._updateMatrix(t,this.matrix,this._frustum)}_updateMatrix(e,t,i,s){uf.multiplyMatrices(e.projectionMatrix,e.matrixWorldInverse),i.setFromProjectionMatrix(uf,e.coordinateSystem,e.reversedDepth);let r=this._frameExtents,o=s?s.z/r.x:1,a=s?s.w/r.y:1,l=s?s.x/r.x:0,c=s?s.y/r.y:0;e.coordinateSystem===ko||e.reversedDepth?t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,1,0,0,0,0,1):t.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,.5,.5,0,0,0,1),t.multiply(uf)}getViewport(e){return this._viewports[e]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(e){return this.camera=e.camera.clone(),this.intensity=e.intensity,this.bias=e.bias,this.radius=e.radius,this.autoUpdate=e.autoUpdate,this.needsUpdate=e.needsUpdate,this.normalBias=e.normalBias,this.blurSamples=e.blurSamples,this.mapSize.copy(e.mapSize),this.mapType=e.mapType,this.biasNode=e.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let e={};return e.intensity=this.intensity,e.bias=this.bias,e.normalBias=this.normalBias,e.radius=this.radius,e.blurSamples=this.blurSamples,e.mapSize=this.mapSize.toArray(),e.mapType=this.mapType,e.camera=this.camera.toJSON(!1).object,delete e.camera.matrix,e}},kc=new O,Bc=new zt,xs=new O,ul=class extends ln{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new Et,this.projectionMatrix=new Et,this.projectionMatrixInverse=new Et,this.coordinateSystem=zi,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(e,t){return super.copy(e,t),this.matrixWorldInverse.copy(e.matrixWorldInverse),this.projectionMatrix.copy(e.projectionMatrix),this.projectionMatrixInverse.copy(e.projectionMatrixInverse),this.coordinateSystem=e.coordinateSystem,this}getWorldDirection(e){return super.getWorldDirection(e).negate()}updateMatrixWorld(e){super.updateMatrixWorld(e),this.matrixWorld.decompose(kc,Bc,xs),xs.x===1&&xs.y===1&&xs.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(kc,Bc,xs.set(1,1,1)).invert()}updateWorldMatrix(e,t,i=!1){super.updateWorldMatrix(e,t,i),this.matrixWorld.decompose(kc,Bc,xs),xs.x===1&&xs.y===1&&xs.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(kc,Bc,xs.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}},cr=new O,t_=new Xe,n_=new Xe,hi=class extends ul{constructor(e=50,t=1,i=.1,s=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=e,this.zoom=1,this.near=i,this.far=s,this.focus=10,this.aspect=t,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.fov=e.fov,this.zoom=e.zoom,this.near=e.near,this.far=e.far,this.focus=e.focus,this.aspect=e.aspect,this.view=e.view===null?null:Object.assign({},e.view),this.filmGauge=e.filmGauge,this.filmOffset=e.filmOffset,this}setFocalLength(e){let t=.5*this.getFilmHeight()/e;this.fov=zo*2*Math.atan(t),this.updateProjectionMatrix()}getFocalLength(){let e=Math.tan(Uo*.5*this.fov);return .5*this.getFilmHeight()/e}getEffectiveFOV(){return zo*2*Math.atan(Math.tan(Uo*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(e,t,i){cr.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),t.set(cr.x,cr.y).multiplyScalar(-e/cr.z),cr.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),i.set(cr.x,cr.y).multiplyScalar(-e/cr.z)}getViewSize(e,t){return this.getViewBounds(e,t_,n_),t.subVectors(n_,t_)}setViewOffset(e,t,i,s,r,o){this.aspect=e/t,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=this.near,t=e*Math.tan(Uo*.5*this.fov)/this.zoom,i=2*t,s=this.aspect*i,r=-.5*s,o=this.view;if(this.view!==null&&this.view.enabled){let l=o.fullWidth,c=o.fullHeight;r+=o.offsetX*s/l,t-=o.offsetY*i/c,s*=o.width/l,i*=o.height/c}let a=this.filmOffset;a!==0&&(r+=e*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(r,r+s,t,t-i,e,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.fov=this.fov,t.object.zoom=this.zoom,t.object.near=this.near,t.object.far=this.far,t.object.focus=this.focus,t.object.aspect=this.aspect,this.view!==null&&(t.object.view=Object.assign({},this.view)),t.object.filmGauge=this.filmGauge,t.object.filmOffset=this.filmOffset,t}};var hl=class extends ul{constructor(e=-1,t=1,i=1,s=-1,r=.1,o=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=e,this.right=t,this.top=i,this.bottom=s,this.near=r,this.far=o,this.updateProjectionMatrix()}copy(e,t){return super.copy(e,t),this.left=e.left,this.right=e.right,this.top=e.top,this.bottom=e.bottom,this.near=e.near,this.far=e.far,this.zoom=e.zoom,this.view=e.view===null?null:Object.assign({},e.view),this}setViewOffset(e,t,i,s,r,o){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=e,this.view.fullHeight=t,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let e=(this.right-this.left)/(2*this.zoom),t=(this.top-this.bottom)/(2*this.zoom),i=(this.right+this.left)/2,s=(this.top+this.bottom)/2,r=i-e,o=i+e,a=s+t,l=s-t;if(this.view!==null&&this.view.enabled){let c=(this.right-this.left)/this.view.fullWidth/this.zoom,u=(this.top-this.bottom)/this.view.fullHeight/this.zoom;r+=c*this.view.offsetX,o=r+c*this.view.width,a-=u*this.view.offsetY,l=a-u*this.view.height}this.projectionMatrix.makeOrthographic(r,o,a,l,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(e){let t=super.toJSON(e);return t.object.zoom=this.zoom,t.object.left=this.left,t.object.right=this.right,t.object.top=this.top,t.object.bottom=this.bottom,t.object.near=this.near,t.object.far=this.far,this.view!==null&&(t.object.view=Object.assign({},this.view)),t}},_f=class extends yu{constructor(){super(new hl(-5,5,5,-5,.5,500)),this.isDirectionalLightShadow=!0}},dl=class extends ll{constructor(e,t){super(e,t),this.isDirectionalLight=!0,this.type="DirectionalLight",this.position.copy(ln.DEFAULT_UP),this.updateMatrix(),this.target=new ln,this.shadow=new _f}dispose(){super.dispose(),this.shadow.dispose()}copy(e){return super.copy(e),this.target=e.target.clone(),this.shadow=e.shadow.clone(),this}toJSON(e){let t=super.toJSON(e);return t.object.shadow=this.shadow.toJSON(),t.object.target=this.target.uuid,t}};var fl=class extends en{constructor(){super(),this.isInstancedBufferGeometry=!0,this.type="InstancedBufferGeometry",this.instanceCount=1/0}copy(e){return super.copy(e),this.instanceCount=e.instanceCount,this}toJSON(){let e=super.toJSON();return e.instanceCount=this.instanceCount,e.isInstancedBufferGeometry=!0,e}};var Io=-90,Lo=1,Yo=class extends ln{constructor(e,t,i){super(),this.type="CubeCamera",this.renderTarget=i,this.coordinateSystem=null,this.activeMipmapLevel=0;let s=new hi(Io,Lo,e,t);s.layers=this.layers,this.add(s);let r=new hi(Io,Lo,e,t);r.layers=this.layers,this.add(r);let o=new hi(Io,Lo,e,t);o.layers=this.layers,this.add(o);let a=new hi(Io,Lo,e,t);a.layers=this.layers,this.add(a);let l=new hi(Io,Lo,e,t);l.layers=this.layers,this.add(l);let c=new hi(Io,Lo,e,t);c.layers=this.layers,this.add(c)}updateCoordinateSystem(){let e=this.coordinateSystem,t=this.children.concat(),[i,s,r,o,a,l]=t;for(let c of t)this.remove(c);if(e===zi)i.up.set(0,1,0),i.lookAt(1,0,0),s.up.set(0,1,0),s.lookAt(-1,0,0),r.up.set(0,0,-1),r.lookAt(0,1,0),o.up.set(0,0,1),o.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),l.up.set(0,1,0),l.lookAt(0,0,-1);else if(e===ko)i.up.set(0,-1,0),i.lookAt(-1,0,0),s.up.set(0,-1,0),s.lookAt(1,0,0),r.up.set(0,0,1),r.lookAt(0,1,0),o.up.set(0,0,-1),o.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),l.up.set(0,-1,0),l.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+e);for(let c of t)this.add(c),c.updateMatrixWorld()}update(e,t){this.parent===null&&this.updateMatrixWorld();let{renderTarget:i,activeMipmapLevel:s}=this;this.coordinateSystem!==e.coordinateSystem&&(this.coordinateSystem=e.coordinateSystem,this.updateCoordinateSystem());let[r,o,a,l,c,u]=this.children,f=e.getRenderTarget(),d=e.getActiveCubeFace(),p=e.getActiveMipmapLevel(),g=e.xr.enabled;e.xr.enabled=!1;let v=i.texture.mipmapsAutoUpdate;i.texture.mipmapsAutoUpdate=!1;let m=!1;e.isWebGLRenderer===!0?m=e.state.buffers.depth.getReversed():m=e.reversedDepthBuffer,e.setRenderTarget(i,0,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,r),e.setRenderTarget(i,1,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,o),e.setRenderTarget(i,2,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,a),e.setRenderTarget(i,3,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,l),e.setRenderTarget(i,4,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,c),i.texture.mipmapsAutoUpdate=v,e.setRenderTarget(i,5,s),m&&e.autoClear===!1&&e.clearDepth(),e.render(t,u),e.setRenderTarget(f,d,p),e.xr.enabled=g,i.texture.needsPMREMUpdate=!0}},bu=class extends hi{constructor(e=[]){super(),this.isArrayCamera=!0,this.isMultiViewCamera=!1,this.cameras=e,this.perCameraFrustumCulled=!1}};var Qf="\\[\\]\\.:\\/",kb=new RegExp("["+Qf+"]","g"),ep="[^"+Qf+"]",Bb="[^"+Qf.replace("\\.","")+"]",zb=/((?:WC+[\/:])*)/.source.replace("WC",ep),Vb=/(WCOD+)?/.source.replace("WCOD",Bb),Gb=/(?:\.(WC+)(?:\[(.+)\])?)?/.source.replace("WC",ep),Hb=/\.(WC+)(?:\[(.+)\])?/.source.replace("WC",ep),Wb=new RegExp("^"+zb+Vb+Gb+Hb+"$"),Xb=["material","materials","bones","map"],vf=class{constructor(e,t,i){let s=i||Qt.parseTrackName(t);this._targetGroup=e,this._bindings=e.subscribe_(t,s)}getValue(e,t){this.bind();let i=this._targetGroup.nCachedObjects_,s=this._bindings[i];s!==void 0&&s.getValue(e,t)}setValue(e,t){let i=this._bindings;for(let s=this._targetGroup.nCachedObjects_,r=i.length;s!==r;++s)i[s].setValue(e,t)}bind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].bind()}unbind(){let e=this._bindings;for(let t=this._targetGroup.nCachedObjects_,i=e.length;t!==i;++t)e[t].unbind()}},Qt=class n{constructor(e,t,i){this.path=t,this.parsedPath=i||n.parseTrackName(t),this.node=n.findNode(e,this.parsedPath.nodeName),this.rootNode=e,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}static create(e,t,i){return e&&e.isAnimationObjectGroup?new n.Composite(e,t,i):new n(e,t,i)}static sanitizeNodeName(e){return e.replace(/\s/g,"_").replace(kb,"")}static parseTrackName(e){let t=Wb.exec(e);if(t===null)throw new Error("THREE.PropertyBinding: Cannot parse trackName: "+e);let i={nodeName:t[2],objectName:t[3],objectIndex:t[4],propertyName:t[5],propertyIndex:t[6]},s=i.nodeName&&i.nodeName.lastIndexOf(".");if(s!==void 0&&s!==-1){let r=i.nodeName.substring(s+1);Xb.indexOf(r)!==-1&&(i.nodeName=i.nodeName.substring(0,s),i.objectName=r)}if(i.propertyName===null||i.propertyName.length===0)throw new Error("THREE.PropertyBinding: can not parse propertyName from trackName: "+e);return i}static findNode(e,t){if(t===void 0||t===""||t==="."||t===-1||t===e.name||t===e.uuid)return e;if(e.skeleton){let i=e.skeleton.getBoneByName(t);if(i!==void 0)return i}if(e.children){let i=function(r){for(let o=0;o<r.length;o++){let a=r[o];if(a.name===t||a.uuid===t)return a;let l=i(a.children);if(l)return l}return null},s=i(e.children);if(s)return s}return null}_getValue_unavailable(){}_setValue_unavailable(){}_getValue_direct(e,t){e[t]=this.targetObject[this.propertyName]}_getValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)e[t++]=i[s]}_getValue_arrayElement(e,t){e[t]=this.resolvedProperty[this.propertyIndex]}_getValue_toArray(e,t){this.resolvedProperty.toArray(e,t)}_setValue_direct(e,t){this.targetObject[this.propertyName]=e[t]}_setValue_direct_setNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.needsUpdate=!0}_setValue_direct_setMatrixWorldNeedsUpdate(e,t){this.targetObject[this.propertyName]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_array(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++]}_setValue_array_setNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.needsUpdate=!0}_setValue_array_setMatrixWorldNeedsUpdate(e,t){let i=this.resolvedProperty;for(let s=0,r=i.length;s!==r;++s)i[s]=e[t++];this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_arrayElement(e,t){this.resolvedProperty[this.propertyIndex]=e[t]}_setValue_arrayElement_setNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.needsUpdate=!0}_setValue_arrayElement_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty[this.propertyIndex]=e[t],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_fromArray(e,t){this.resolvedProperty.fromArray(e,t)}_setValue_fromArray_setNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.needsUpdate=!0}_setValue_fromArray_setMatrixWorldNeedsUpdate(e,t){this.resolvedProperty.fromArray(e,t),this.targetObject.matrixWorldNeedsUpdate=!0}_getValue_unbound(e,t){this.bind(),this.getValue(e,t)}_setValue_unbound(e,t){this.bind(),this.setValue(e,t)}bind(){let e=this.node,t=this.parsedPath,i=t.objectName,s=t.propertyName,r=t.propertyIndex;if(e||(e=n.findNode(this.rootNode,t.nodeName),this.node=e),this.getValue=this._getValue_unavailable,this.setValue=this._setValue_unavailable,!e){Je("PropertyBinding: No target node found for track: "+this.path+".");return}if(i){let c=t.objectIndex;switch(i){case"materials":if(!e.material){Qe("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.materials){Qe("PropertyBinding: Can not bind to material.materials as node.material does not have a materials array.",this);return}e=e.material.materials;break;case"bones":if(!e.skeleton){Qe("PropertyBinding: Can not bind to bones as node does not have a skeleton.",this);return}e=e.skeleton.bones;for(let u=0;u<e.length;u++)if(e[u].name===c){c=u;break}break;case"map":if("map"in e){e=e.map;break}if(!e.material){Qe("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!e.material.map){Qe("PropertyBinding: Can not bind to material.map as node.material does not have a map.",this);return}e=e.material.map;break;default:if(e[i]===void 0){Qe("PropertyBinding: Can not bind to objectName of node undefined.",this);return}e=e[i]}if(c!==void 0){if(e[c]===void 0){Qe("PropertyBinding: Trying to bind to objectIndex of objectName, but is undefined.",this,e);return}e=e[c]}}let o=e[s];if(o===void 0){let c=t.nodeName;Qe("PropertyBinding: Trying to update property for track: "+c+"."+s+" but it wasn't found.",e);return}let a=this.Versioning.None;this.targetObject=e,e.isMaterial===!0?a=this.Versioning.NeedsUpdate:e.isObject3D===!0&&(a=this.Versioning.MatrixWorldNeedsUpdate);let l=this.BindingType.Direct;if(r!==void 0){if(s==="morphTargetInfluences"){if(!e.geometry){Qe("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.",this);return}if(!e.geometry.morphAttributes){Qe("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.morphAttributes.",this);return}e.morphTargetDictionary[r]!==void 0&&(r=e.morphTargetDictionary[r])}l=this.BindingType.ArrayElement,this.resolvedProperty=o,this.propertyIndex=r}else o.fromArray!==void 0&&o.toArray!==void 0?(l=this.BindingType.HasFromToArray,this.resolvedProperty=o):Array.isArray(o)?(l=this.BindingType.EntireArray,this.resolvedProperty=o):this.propertyName=s;this.getValue=this.GetterByBindingType[l],this.setValue=this.SetterByBindingTypeAndVersioning[l][a]}unbind(){this.node=null,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}};Qt.Composite=vf;Qt.prototype.BindingType={Direct:0,EntireArray:1,ArrayElement:2,HasFromToArray:3};Qt.prototype.Versioning={None:0,NeedsUpdate:1,MatrixWorldNeedsUpdate:2};Qt.prototype.GetterByBindingType=[Qt.prototype._getValue_direct,Qt.prototype._getValue_array,Qt.prototype._getValue_arrayElement,Qt.prototype._getValue_toArray];Qt.prototype.SetterByBindingTypeAndVersioning=[[Qt.prototype._setValue_direct,Qt.prototype._setValue_direct_setNeedsUpdate,Qt.prototype._setValue_direct_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_array,Qt.prototype._setValue_array_setNeedsUpdate,Qt.prototype._setValue_array_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_arrayElement,Qt.prototype._setValue_arrayElement_setNeedsUpdate,Qt.prototype._setValue_arrayElement_setMatrixWorldNeedsUpdate],[Qt.prototype._setValue_fromArray,Qt.prototype._setValue_fromArray_setNeedsUpdate,Qt.prototype._setValue_fromArray_setMatrixWorldNeedsUpdate]];var DP=new Float32Array(1);var gr=class extends Ka{constructor(e,t,i=1){super(e,t),this.isInstancedInterleavedBuffer=!0,this.meshPerAttribute=i}copy(e){return super.copy(e),this.meshPerAttribute=e.meshPerAttribute,this}clone(e){let t=super.clone(e);return t.meshPerAttribute=this.meshPerAttribute,t}toJSON(e){let t=super.toJSON(e);return t.isInstancedInterleavedBuffer=!0,t.meshPerAttribute=this.meshPerAttribute,t}};var i_=new Et,pl=class{constructor(e,t,i=0,s=1/0){this.ray=new Gs(e,t),this.near=i,this.far=s,this.camera=null,this.layers=new Go,this.params={Mesh:{},Line:{threshold:1},LOD:{},Points:{threshold:1},Sprite:{}}}set(e,t){this.ray.set(e,t)}setFromCamera(e,t){t.isPerspectiveCamera?(this.ray.origin.setFromMatrixPosition(t.matrixWorld),this.ray.direction.set(e.x,e.y,.5).unproject(t).sub(this.ray.origin).normalize(),this.camera=t):t.isOrthographicCamera?(this.ray.origin.set(e.x,e.y,t.projectionMatrix.elements[14]).unproject(t),this.ray.direction.set(0,0,-1).transformDirection(t.matrixWorld),this.camera=t):Qe("Raycaster: Unsupported camera type: "+t.type)}setFromXRController(e){return i_.identity().extractRotation(e.matrixWorld),this.ray.origin.setFromMatrixPosition(e.matrixWorld),this.ray.direction.set(0,0,-1).applyMatrix4(i_),this}intersectObject(e,t=!0,i=[]){return xf(e,this,i,t),i.sort(s_),i}intersectObjects(e,t=!0,i=[]){for(let s=0,r=e.length;s<r;s++)xf(e[s],this,i,t);return i.sort(s_),i}};function s_(n,e){return n.distance-e.distance}function xf(n,e,t,i){let s=!0;if(n.layers.test(e.layers)&&n.raycast(e,t)===!1&&(s=!1),s===!0&&i===!0){let r=n.children;for(let o=0,a=r.length;o<a;o++)xf(r[o],e,t,!0)}}var $o=class{constructor(e=1,t=0,i=0){this.radius=e,this.phi=t,this.theta=i}set(e,t,i){return this.radius=e,this.phi=t,this.theta=i,this}copy(e){return this.radius=e.radius,this.phi=e.phi,this.theta=e.theta,this}makeSafe(){return this.phi=ht(this.phi,1e-6,Math.PI-1e-6),this}setFromVector3(e){return this.setFromCartesianCoords(e.x,e.y,e.z)}setFromCartesianCoords(e,t,i){return this.radius=Math.sqrt(e*e+t*t+i*i),this.radius===0?(this.theta=0,this.phi=0):(this.theta=Math.atan2(e,i),this.phi=Math.acos(ht(t/this.radius,-1,1))),this}clone(){return new this.constructor().copy(this)}};var yf=class{static{this.prototype.isMatrix2=!0}constructor(e,t,i,s){this.elements=[1,0,0,1],e!==void 0&&this.set(e,t,i,s)}identity(){return this.set(1,0,0,1),this}fromArray(e,t=0){for(let i=0;i<4;i++)this.elements[i]=e[i+t];return this}set(e,t,i,s){let r=this.elements;return r[0]=e,r[2]=t,r[1]=i,r[3]=s,this}};var r_=new O,zc=new O,Do=new O,No=new O,hf=new O,qb=new O,Yb=new O,ml=class{constructor(e=new O,t=new O){this.start=e,this.end=t}set(e,t){return this.start.copy(e),this.end.copy(t),this}copy(e){return this.start.copy(e.start),this.end.copy(e.end),this}getCenter(e){return e.addVectors(this.start,this.end).multiplyScalar(.5)}delta(e){return e.subVectors(this.end,this.start)}distanceSq(){return this.start.distanceToSquared(this.end)}distance(){return this.start.distanceTo(this.end)}at(e,t){return this.delta(t).multiplyScalar(e).add(this.start)}closestPointToPointParameter(e,t){r_.subVectors(e,this.start),zc.subVectors(this.end,this.start);let i=zc.dot(zc);if(i===0)return 0;let r=zc.dot(r_)/i;return t&&(r=ht(r,0,1)),r}closestPointToPoint(e,t,i){let s=this.closestPointToPointParameter(e,t);return this.delta(i).multiplyScalar(s).add(this.start)}distanceSqToLine3(e,t=qb,i=Yb){let s=10000000000000001e-32,r,o,a=this.start,l=e.start,c=this.end,u=e.end;Do.subVectors(c,a),No.subVectors(u,l),hf.subVectors(a,l);let f=Do.dot(Do),d=No.dot(No),p=No.dot(hf);if(f<=s&&d<=s)return t.copy(a),i.copy(l),t.distanceToSquared(i);if(f<=s)r=0,o=p/d,o=ht(o,0,1);else{let g=Do.dot(hf);if(d<=s)o=0,r=ht(-g/f,0,1);else{let v=Do.dot(No),m=f*d-v*v;m!==0?r=ht((v*p-g*d)/m,0,1):r=0,o=(v*r+p)/d,o<0?(o=0,r=ht(-g/f,0,1)):o>1&&(o=1,r=ht((v-g)/f,0,1))}}return t.copy(a).addScaledVector(Do,r),i.copy(l).addScaledVector(No,o),t.distanceToSquared(i)}applyMatrix4(e){return this.start.applyMatrix4(e),this.end.applyMatrix4(e),this}equals(e){return e.start.equals(this.start)&&e.end.equals(this.end)}clone(){return new this.constructor().copy(this)}};var Zo=class extends Fr{constructor(e=10,t=10,i=4473924,s=8947848){i=new it(i),s=new it(s);let r=t/2,o=e/t,a=e/2,l=[],c=[];for(let d=0,p=0,g=-a;d<=t;d++,g+=o){l.push(-a,0,g,a,0,g),l.push(g,0,-a,g,0,a);let v=d===r?i:s;v.toArray(c,p),p+=3,v.toArray(c,p),p+=3,v.toArray(c,p),p+=3,v.toArray(c,p),p+=3}let u=new en;u.setAttribute("position",new Mt(l,3)),u.setAttribute("color",new Mt(c,3));let f=new _i({vertexColors:!0,toneMapped:!1});super(u,f),this.type="GridHelper"}dispose(){super.dispose(),this.geometry.dispose(),this.material.dispose()}};var zr=class extends es{constructor(e,t=null){super(),this.object=e,this.domElement=t,this.enabled=!0,this.state=-1,this.keys={},this.mouseButtons={LEFT:null,MIDDLE:null,RIGHT:null},this.touches={ONE:null,TWO:null}}connect(e){this.domElement!==null&&this.disconnect(),this.domElement=e}disconnect(){}dispose(){}update(){}};function tp(n,e,t,i){let s=$b(i);switch(t){case zf:return n*e;case Gf:return n*e/s.components*s.byteLength;case Cu:return n*e/s.components*s.byteLength;case yr:return n*e*2/s.components*s.byteLength;case Ru:return n*e*2/s.components*s.byteLength;case Vf:return n*e*3/s.components*s.byteLength;case as:return n*e*4/s.components*s.byteLength;case Pu:return n*e*4/s.components*s.byteLength;case vl:case xl:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case yl:case bl:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Lu:case Nu:return Math.max(n,16)*Math.max(e,8)/4;case Iu:case Du:return Math.max(n,8)*Math.max(e,8)/2;case Uu:case Ou:case ku:case Bu:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*8;case Fu:case Sl:case zu:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Vu:return Math.floor((n+3)/4)*Math.floor((e+3)/4)*16;case Gu:return Math.floor((n+4)/5)*Math.floor((e+3)/4)*16;case Hu:return Math.floor((n+4)/5)*Math.floor((e+4)/5)*16;case Wu:return Math.floor((n+5)/6)*Math.floor((e+4)/5)*16;case Xu:return Math.floor((n+5)/6)*Math.floor((e+5)/6)*16;case qu:return Math.floor((n+7)/8)*Math.floor((e+4)/5)*16;case Yu:return Math.floor((n+7)/8)*Math.floor((e+5)/6)*16;case $u:return Math.floor((n+7)/8)*Math.floor((e+7)/8)*16;case Zu:return Math.floor((n+9)/10)*Math.floor((e+4)/5)*16;case Ju:return Math.floor((n+9)/10)*Math.floor((e+5)/6)*16;case Ku:return Math.floor((n+9)/10)*Math.floor((e+7)/8)*16;case ju:return Math.floor((n+9)/10)*Math.floor((e+9)/10)*16;case Qu:return Math.floor((n+11)/12)*Math.floor((e+9)/10)*16;case eh:return Math.floor((n+11)/12)*Math.floor((e+11)/12)*16;case th:case nh:case ih:return Math.ceil(n/4)*Math.ceil(e/4)*16;case sh:case rh:return Math.ceil(n/4)*Math.ceil(e/4)*8;case Ml:case oh:return Math.ceil(n/4)*Math.ceil(e/4)*16}throw new Error(`Unable to determine texture byte length for ${t} format.`)}function $b(n){switch(n){case yi:case Of:return{byteLength:1,components:1};case Qo:case Ff:case os:return{byteLength:2,components:1};case Eu:case Au:return{byteLength:2,components:4};case ss:case Tu:case rs:return{byteLength:4,components:1};case kf:case Bf:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${n}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?Je("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");function f0(){let n=null,e=!1,t=null,i=null;function s(r,o){i=n.requestAnimationFrame(s),t(r,o)}return{start:function(){e!==!0&&t!==null&&n!==null&&(i=n.requestAnimationFrame(s),e=!0)},stop:function(){n!==null&&n.cancelAnimationFrame(i),e=!1},setAnimationLoop:function(r){t=r},setContext:function(r){n=r}}}function Jb(n){let e=new WeakMap;function t(a,l){let c=a.array,u=a.usage,f=c.byteLength,d=n.createBuffer();n.bindBuffer(l,d),n.bufferData(l,c,u),a.onUploadCallback();let p;if(c instanceof Float32Array)p=n.FLOAT;else if(typeof Float16Array<"u"&&c instanceof Float16Array)p=n.HALF_FLOAT;else if(c instanceof Uint16Array)a.isFloat16BufferAttribute?p=n.HALF_FLOAT:p=n.UNSIGNED_SHORT;else if(c instanceof Int16Array)p=n.SHORT;else if(c instanceof Uint32Array)p=n.UNSIGNED_INT;else if(c instanceof Int32Array)p=n.INT;else if(c instanceof Int8Array)p=n.BYTE;else if(c instanceof Uint8Array)p=n.UNSIGNED_BYTE;else if(c instanceof Uint8ClampedArray)p=n.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+c);return{buffer:d,type:p,bytesPerElement:c.BYTES_PER_ELEMENT,version:a.version,size:f}}function i(a,l,c){let u=l.array,f=l.updateRanges;if(n.bindBuffer(c,a),f.length===0)n.bufferSubData(c,0,u);else{f.sort((p,g)=>p.start-g.start);let d=0;for(let p=1;p<f.length;p++){let g=f[d],v=f[p];v.start<=g.start+g.count+1?g.count=Math.max(g.count,v.start+v.count-g.start):(++d,f[d]=v)}f.length=d+1;for(let p=0,g=f.length;p<g;p++){let v=f[p];n.bufferSubData(c,v.start*u.BYTES_PER_ELEMENT,u,v.start,v.count)}l.clearUpdateRanges()}l.onUploadCallback()}function s(a){return a.isInterleavedBufferAttribute&&(a=a.data),e.get(a)}function r(a){a.isInterleavedBufferAttribute&&(a=a.data);let l=e.get(a);l&&(n.deleteBuffer(l.buffer),e.delete(a))}function o(a,l){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){let u=e.get(a);(!u||u.version<a.version)&&e.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}let c=e.get(a);if(c===void 0)e.set(a,t(a,l));else if(c.version<a.version){if(c.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");i(c.buffer,a,l),c.version=a.version}}return{get:s,remove:r,update:o}}var Kb=`#ifdef USE_ALPHAHASH
	if ( diffuseColor.a < getAlphaHashThreshold( vPosition ) ) discard;
#endif`,jb=`#ifdef USE_ALPHAHASH
	const float ALPHA_HASH_SCALE = 0.05;
	float hash2D( vec2 value ) {
		return fract( 1.0e4 * sin( 17.0 * value.x + 0.1 * value.y ) * ( 0.1 + abs( sin( 13.0 * value.y + value.x ) ) ) );
	}
	float hash3D( vec3 value ) {
		return hash2D( vec2( hash2D( value.xy ), value.z ) );
	}
	float getAlphaHashThreshold( vec3 position ) {
		float maxDeriv = max(
			length( dFdx( position.xyz ) ),
			length( dFdy( position.xyz ) )
		);
		float pixScale = 1.0 / ( ALPHA_HASH_SCALE * maxDeriv );
		vec2 pixScales = vec2(
			exp2( floor( log2( pixScale ) ) ),
			exp2( ceil( log2( pixScale ) ) )
		);
		vec2 alpha = vec2(
			hash3D( floor( pixScales.x * position.xyz ) ),
			hash3D( floor( pixScales.y * position.xyz ) )
		);
		float lerpFactor = fract( log2( pixScale ) );
		float x = ( 1.0 - lerpFactor ) * alpha.x + lerpFactor * alpha.y;
		float a = min( lerpFactor, 1.0 - lerpFactor );
		vec3 cases = vec3(
			x * x / ( 2.0 * a * ( 1.0 - a ) ),
			( x - 0.5 * a ) / ( 1.0 - a ),
			1.0 - ( ( 1.0 - x ) * ( 1.0 - x ) / ( 2.0 * a * ( 1.0 - a ) ) )
		);
		float threshold = ( x < ( 1.0 - a ) )
			? ( ( x < a ) ? cases.x : cases.y )
			: cases.z;
		return clamp( threshold , 1.0e-6, 1.0 );
	}
#endif`,Qb=`#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, vAlphaMapUv ).g;
#endif`,eS=`#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,tS=`#ifdef USE_ALPHATEST
	#ifdef ALPHA_TO_COVERAGE
	diffuseColor.a = smoothstep( alphaTest, alphaTest + fwidth( diffuseColor.a ), diffuseColor.a );
	if ( diffuseColor.a == 0.0 ) discard;
	#else
	if ( diffuseColor.a < alphaTest ) discard;
	#endif
#endif`,nS=`#ifdef USE_ALPHATEST
	uniform float alphaTest;
#endif`,iS=`#ifdef USE_AOMAP
	float ambientOcclusion = ( texture2D( aoMap, vAoMapUv ).r - 1.0 ) * aoMapIntensity + 1.0;
	reflectedLight.indirectDiffuse *= ambientOcclusion;
	#if defined( USE_CLEARCOAT ) 
		clearcoatSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_SHEEN ) 
		sheenSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_ENVMAP ) && defined( STANDARD )
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		reflectedLight.indirectSpecular *= computeSpecularOcclusion( dotNV, ambientOcclusion, material.roughness );
	#endif
#endif`,sS=`#ifdef USE_AOMAP
	uniform sampler2D aoMap;
	uniform float aoMapIntensity;
#endif`,rS=`#ifdef USE_BATCHING
	#if ! defined( GL_ANGLE_multi_draw )
	#define gl_DrawID _gl_DrawID
	uniform int _gl_DrawID;
	#endif
	uniform highp sampler2D batchingTexture;
	uniform highp usampler2D batchingIdTexture;
	mat4 getBatchingMatrix( const in float i ) {
		int size = textureSize( batchingTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( batchingTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( batchingTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( batchingTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( batchingTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
	float getIndirectIndex( const in int i ) {
		int size = textureSize( batchingIdTexture, 0 ).x;
		int x = i % size;
		int y = i / size;
		return float( texelFetch( batchingIdTexture, ivec2( x, y ), 0 ).r );
	}
#endif
#ifdef USE_BATCHING_COLOR
	uniform sampler2D batchingColorTexture;
	vec4 getBatchingColor( const in float i ) {
		int size = textureSize( batchingColorTexture, 0 ).x;
		int j = int( i );
		int x = j % size;
		int y = j / size;
		return texelFetch( batchingColorTexture, ivec2( x, y ), 0 );
	}
#endif`,oS=`#ifdef USE_BATCHING
	mat4 batchingMatrix = getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif`,aS=`vec3 transformed = vec3( position );
#ifdef USE_ALPHAHASH
	vPosition = vec3( position );
#endif`,lS=`vec3 objectNormal = vec3( normal );
#ifdef USE_TANGENT
	vec3 objectTangent = vec3( tangent.xyz );
#endif`,cS=`float G_BlinnPhong_Implicit( ) {
	return 0.25;
}
float D_BlinnPhong( const in float shininess, const in float dotNH ) {
	return RECIPROCAL_PI * ( shininess * 0.5 + 1.0 ) * pow( dotNH, shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 specularColor, const in float shininess ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( specularColor, 1.0, dotVH );
	float G = G_BlinnPhong_Implicit( );
	float D = D_BlinnPhong( shininess, dotNH );
	return F * ( G * D );
} // validated`,uS=`#ifdef USE_IRIDESCENCE
	const mat3 XYZ_TO_REC709 = mat3(
		 3.2404542, -0.9692660,  0.0556434,
		-1.5371385,  1.8760108, -0.2040259,
		-0.4985314,  0.0415560,  1.0572252
	);
	vec3 Fresnel0ToIor( vec3 fresnel0 ) {
		vec3 sqrtF0 = sqrt( fresnel0 );
		return ( vec3( 1.0 ) + sqrtF0 ) / ( vec3( 1.0 ) - sqrtF0 );
	}
	vec3 IorToFresnel0( vec3 transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - vec3( incidentIor ) ) / ( transmittedIor + vec3( incidentIor ) ) );
	}
	float IorToFresnel0( float transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - incidentIor ) / ( transmittedIor + incidentIor ));
	}
	vec3 evalSensitivity( float OPD, vec3 shift ) {
		float phase = 2.0 * PI * OPD * 1.0e-9;
		vec3 val = vec3( 5.4856e-13, 4.4201e-13, 5.2481e-13 );
		vec3 pos = vec3( 1.6810e+06, 1.7953e+06, 2.2084e+06 );
		vec3 var = vec3( 4.3278e+09, 9.3046e+09, 6.6121e+09 );
		vec3 xyz = val * sqrt( 2.0 * PI * var ) * cos( pos * phase + shift ) * exp( - pow2( phase ) * var );
		xyz.x += 9.7470e-14 * sqrt( 2.0 * PI * 4.5282e+09 ) * cos( 2.2399e+06 * phase + shift[ 0 ] ) * exp( - 4.5282e+09 * pow2( phase ) );
		xyz /= 1.0685e-7;
		vec3 rgb = XYZ_TO_REC709 * xyz;
		return rgb;
	}
	vec3 evalIridescence( float outsideIOR, float eta2, float cosTheta1, float thinFilmThickness, vec3 baseF0 ) {
		vec3 I;
		float iridescenceIOR = mix( outsideIOR, eta2, smoothstep( 0.0, 0.03, thinFilmThickness ) );
		float sinTheta2Sq = pow2( outsideIOR / iridescenceIOR ) * ( 1.0 - pow2( cosTheta1 ) );
		float cosTheta2Sq = 1.0 - sinTheta2Sq;
		if ( cosTheta2Sq < 0.0 ) {
			return vec3( 1.0 );
		}
		float cosTheta2 = sqrt( cosTheta2Sq );
		float R0 = IorToFresnel0( iridescenceIOR, outsideIOR );
		float R12 = F_Schlick( R0, 1.0, cosTheta1 );
		float T121 = 1.0 - R12;
		float phi12 = 0.0;
		if ( iridescenceIOR < outsideIOR ) phi12 = PI;
		float phi21 = PI - phi12;
		vec3 baseIOR = Fresnel0ToIor( clamp( baseF0, 0.0, 0.9999 ) );		vec3 R1 = IorToFresnel0( baseIOR, iridescenceIOR );
		vec3 R23 = F_Schlick( R1, 1.0, cosTheta2 );
		vec3 phi23 = vec3( 0.0 );
		if ( baseIOR[ 0 ] < iridescenceIOR ) phi23[ 0 ] = PI;
		if ( baseIOR[ 1 ] < iridescenceIOR ) phi23[ 1 ] = PI;
		if ( baseIOR[ 2 ] < iridescenceIOR ) phi23[ 2 ] = PI;
		float OPD = 2.0 * iridescenceIOR * thinFilmThickness * cosTheta2;
		vec3 phi = vec3( phi21 ) + phi23;
		vec3 R123 = clamp( R12 * R23, 1e-5, 0.9999 );
		vec3 r123 = sqrt( R123 );
		vec3 Rs = pow2( T121 ) * R23 / ( vec3( 1.0 ) - R123 );
		vec3 C0 = R12 + Rs;
		I = C0;
		vec3 Cm = Rs - T121;
		for ( int m = 1; m <= 2; ++ m ) {
			Cm *= r123;
			vec3 Sm = 2.0 * evalSensitivity( float( m ) * OPD, float( m ) * phi );
			I += Cm * Sm;
		}
		return max( I, vec3( 0.0 ) );
	}
#endif`,hS=`#ifdef USE_BUMPMAP
	uniform sampler2D bumpMap;
	uniform float bumpScale;
	vec2 dHdxy_fwd() {
		vec2 dSTdx = dFdx( vBumpMapUv );
		vec2 dSTdy = dFdy( vBumpMapUv );
		float Hll = bumpScale * texture2D( bumpMap, vBumpMapUv ).x;
		float dBx = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdx ).x - Hll;
		float dBy = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdy ).x - Hll;
		return vec2( dBx, dBy );
	}
	vec3 perturbNormalArb( vec3 surf_pos, vec3 surf_norm, vec2 dHdxy, float faceDirection ) {
		vec3 vSigmaX = normalize( dFdx( surf_pos.xyz ) );
		vec3 vSigmaY = normalize( dFdy( surf_pos.xyz ) );
		vec3 vN = surf_norm;
		vec3 R1 = cross( vSigmaY, vN );
		vec3 R2 = cross( vN, vSigmaX );
		float fDet = dot( vSigmaX, R1 ) * faceDirection;
		vec3 vGrad = sign( fDet ) * ( dHdxy.x * R1 + dHdxy.y * R2 );
		return normalize( abs( fDet ) * surf_norm - vGrad );
	}
#endif`,dS=`#if NUM_CLIPPING_PLANES > 0
	vec4 plane;
	#ifdef ALPHA_TO_COVERAGE
		float distanceToPlane, distanceGradient;
		float clipOpacity = 1.0;
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
			distanceGradient = fwidth( distanceToPlane ) / 2.0;
			clipOpacity *= smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			if ( clipOpacity == 0.0 ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			float unionClipOpacity = 1.0;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
				distanceGradient = fwidth( distanceToPlane ) / 2.0;
				unionClipOpacity *= 1.0 - smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			}
			#pragma unroll_loop_end
			clipOpacity *= 1.0 - unionClipOpacity;
		#endif
		diffuseColor.a *= clipOpacity;
		if ( diffuseColor.a == 0.0 ) discard;
	#else
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			if ( dot( vClipPosition, plane.xyz ) > plane.w ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			bool clipped = true;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				clipped = ( dot( vClipPosition, plane.xyz ) > plane.w ) && clipped;
			}
			#pragma unroll_loop_end
			if ( clipped ) discard;
		#endif
	#endif
#endif`,fS=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
	uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif`,pS=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
#endif`,mS=`#if NUM_CLIPPING_PLANES > 0
	vClipPosition = - mvPosition.xyz;
#endif`,gS=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	diffuseColor *= vColor;
#endif`,_S=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	varying vec4 vColor;
#endif`,vS=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	varying vec4 vColor;
#endif`,xS=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	vColor = vec4( 1.0 );
#endif
#ifdef USE_COLOR_ALPHA
	vColor *= color;
#elif defined( USE_COLOR )
	vColor.rgb *= color;
#endif
#ifdef USE_INSTANCING_COLOR
	vColor.rgb *= instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
	vColor *= getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif`,yS=`#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ) { return x*x; }
vec3 pow2( const in vec3 x ) { return x*x; }
float pow3( const in float x ) { return x*x*x; }
float pow4( const in float x ) { float x2 = x*x; return x2*x2; }
float max3( const in vec3 v ) { return max( max( v.x, v.y ), v.z ); }
float average( const in vec3 v ) { return dot( v, vec3( 0.3333333 ) ); }
highp float rand( const in vec2 uv ) {
	const highp float a = 12.9898, b = 78.233, c = 43758.5453;
	highp float dt = dot( uv.xy, vec2( a,b ) ), sn = mod( dt, PI );
	return fract( sin( sn ) * c );
}
#ifdef HIGH_PRECISION
	float precisionSafeLength( vec3 v ) { return length( v ); }
#else
	float precisionSafeLength( vec3 v ) {
		float maxComponent = max3( abs( v ) );
		return length( v / maxComponent ) * maxComponent;
	}
#endif
struct IncidentLight {
	vec3 color;
	vec3 direction;
	bool visible;
};
struct ReflectedLight {
	vec3 directDiffuse;
	vec3 directSpecular;
	vec3 indirectDiffuse;
	vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
	varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir, in mat4 matrix ) {
	return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal, in mat4 viewMatrix ) {
	return normalize( ( vec4( normal, 0.0 ) * viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir, in mat4 viewMatrix ) {
	return normalize( ( vec4( dir, 0.0 ) * viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ) {
	return m[ 2 ][ 3 ] == - 1.0;
}
vec2 equirectUv( in vec3 dir ) {
	float u = atan( dir.z, dir.x ) * RECIPROCAL_PI2 + 0.5;
	float v = asin( clamp( dir.y, - 1.0, 1.0 ) ) * RECIPROCAL_PI + 0.5;
	return vec2( u, v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ) {
	return RECIPROCAL_PI * diffuseColor;
}
vec3 F_Schlick( const in vec3 f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
}
float F_Schlick( const in float f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
} // validated`,bS=`vec3 transformedNormal = objectNormal;
#ifdef USE_TANGENT
	vec3 transformedTangent = objectTangent;
#endif
#ifdef USE_BATCHING
	mat3 bm = mat3( batchingMatrix );
	transformedNormal /= vec3( dot( bm[ 0 ], bm[ 0 ] ), dot( bm[ 1 ], bm[ 1 ] ), dot( bm[ 2 ], bm[ 2 ] ) );
	transformedNormal = bm * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = bm * transformedTangent;
	#endif
#endif
#ifdef USE_INSTANCING
	mat3 im = mat3( instanceMatrix );
	transformedNormal /= vec3( dot( im[ 0 ], im[ 0 ] ), dot( im[ 1 ], im[ 1 ] ), dot( im[ 2 ], im[ 2 ] ) );
	transformedNormal = im * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = im * transformedTangent;
	#endif
#endif
transformedNormal = normalMatrix * transformedNormal;
#ifdef FLIP_SIDED
	transformedNormal = - transformedNormal;
#endif
#ifdef USE_TANGENT
	transformedTangent = ( modelViewMatrix * vec4( transformedTangent, 0.0 ) ).xyz;
#endif`,SS=`#ifdef USE_DISPLACEMENTMAP
	uniform sampler2D displacementMap;
	uniform float displacementScale;
	uniform float displacementBias;
#endif`,MS=`#ifdef USE_DISPLACEMENTMAP
	transformed += normalize( objectNormal ) * ( texture2D( displacementMap, vDisplacementMapUv ).x * displacementScale + displacementBias );
#endif`,wS=`#ifdef USE_EMISSIVEMAP
	vec4 emissiveColor = texture2D( emissiveMap, vEmissiveMapUv );
	#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
		emissiveColor = sRGBTransferEOTF( emissiveColor );
	#endif
	totalEmissiveRadiance *= emissiveColor.rgb;
#endif`,TS=`#ifdef USE_EMISSIVEMAP
	uniform sampler2D emissiveMap;
#endif`,ES="gl_FragColor = linearToOutputTexel( gl_FragColor );",AS=`vec4 LinearTransferOETF( in vec4 value ) {
	return value;
}
vec4 sRGBTransferEOTF( in vec4 value ) {
	return vec4( mix( pow( value.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), value.rgb * 0.0773993808, vec3( lessThanEqual( value.rgb, vec3( 0.04045 ) ) ) ), value.a );
}
vec4 sRGBTransferOETF( in vec4 value ) {
	return vec4( mix( pow( value.rgb, vec3( 0.41666 ) ) * 1.055 - vec3( 0.055 ), value.rgb * 12.92, vec3( lessThanEqual( value.rgb, vec3( 0.0031308 ) ) ) ), value.a );
}`,CS=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vec3 cameraToFrag;
		if ( isOrthographic ) {
			cameraToFrag = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToFrag = normalize( vWorldPosition - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vec3 reflectVec = reflect( cameraToFrag, worldNormal );
		#else
			vec3 reflectVec = refract( cameraToFrag, worldNormal, refractionRatio );
		#endif
	#else
		vec3 reflectVec = vReflect;
	#endif
	#ifdef ENVMAP_TYPE_CUBE
		vec4 envColor = textureCube( envMap, envMapRotation * reflectVec );
		#ifdef ENVMAP_BLENDING_MULTIPLY
			outgoingLight = mix( outgoingLight, outgoingLight * envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_MIX )
			outgoingLight = mix( outgoingLight, envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_ADD )
			outgoingLight += envColor.xyz * specularStrength * reflectivity;
		#endif
	#endif
#endif`,RS=`#ifdef USE_ENVMAP
	uniform float envMapIntensity;
	uniform mat3 envMapRotation;
	uniform samplerCube envMap;
	#ifdef ENVMAP_TYPE_PMREM
		float roughnessToMip( const in float roughness ) {
			float r = clamp( roughness, 0.0, 1.0 );
			return ENVMAP_MAX_LOD * r * ( 2.0 - r );
		}
	#endif
#endif`,PS=`#ifdef USE_ENVMAP
	uniform float reflectivity;
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		varying vec3 vWorldPosition;
		uniform float refractionRatio;
	#else
		varying vec3 vReflect;
	#endif
#endif`,IS=`#ifdef USE_ENVMAP
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		
		varying vec3 vWorldPosition;
	#else
		varying vec3 vReflect;
		uniform float refractionRatio;
	#endif
#endif`,LS=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vWorldPosition = worldPosition.xyz;
	#else
		vec3 cameraToVertex;
		if ( isOrthographic ) {
			cameraToVertex = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToVertex = normalize( worldPosition.xyz - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vReflect = reflect( cameraToVertex, worldNormal );
		#else
			vReflect = refract( cameraToVertex, worldNormal, refractionRatio );
		#endif
	#endif
#endif`,DS=`#ifdef USE_FOG
	vFogDepth = - mvPosition.z;
#endif`,NS=`#ifdef USE_FOG
	varying float vFogDepth;
#endif`,US=`#ifdef USE_FOG
	#ifdef FOG_EXP2
		float fogFactor = 1.0 - exp( - fogDensity * fogDensity * vFogDepth * vFogDepth );
	#else
		float fogFactor = smoothstep( fogNear, fogFar, vFogDepth );
	#endif
	gl_FragColor.rgb = mix( gl_FragColor.rgb, fogColor, fogFactor );
#endif`,OS=`#ifdef USE_FOG
	uniform vec3 fogColor;
	varying float vFogDepth;
	#ifdef FOG_EXP2
		uniform float fogDensity;
	#else
		uniform float fogNear;
		uniform float fogFar;
	#endif
#endif`,FS=`#ifdef USE_GRADIENTMAP
	uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal, vec3 lightDirection ) {
	float dotNL = dot( normal, lightDirection );
	vec2 coord = vec2( dotNL * 0.5 + 0.5, 0.0 );
	#ifdef USE_GRADIENTMAP
		return vec3( texture2D( gradientMap, coord ).r );
	#else
		vec2 fw = fwidth( coord ) * 0.5;
		return mix( vec3( 0.7 ), vec3( 1.0 ), smoothstep( 0.7 - fw.x, 0.7 + fw.x, coord.x ) );
	#endif
}`,kS=`#ifdef USE_LIGHTMAP
	uniform sampler2D lightMap;
	uniform float lightMapIntensity;
#endif`,BS=`LambertMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularStrength = specularStrength;`,zS=`varying vec3 vViewPosition;
struct LambertMaterial {
	vec3 diffuseColor;
	float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert`,VS=`uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
	uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal, in vec3 shCoefficients[ 9 ] ) {
	float x = normal.x, y = normal.y, z = normal.z;
	vec3 result = shCoefficients[ 0 ] * 0.886227;
	result += shCoefficients[ 1 ] * 2.0 * 0.511664 * y;
	result += shCoefficients[ 2 ] * 2.0 * 0.511664 * z;
	result += shCoefficients[ 3 ] * 2.0 * 0.511664 * x;
	result += shCoefficients[ 4 ] * 2.0 * 0.429043 * x * y;
	result += shCoefficients[ 5 ] * 2.0 * 0.429043 * y * z;
	result += shCoefficients[ 6 ] * ( 0.743125 * z * z - 0.247708 );
	result += shCoefficients[ 7 ] * 2.0 * 0.429043 * x * z;
	result += shCoefficients[ 8 ] * 0.429043 * ( x * x - y * y );
	return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ], const in vec3 normal ) {
	vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec3 irradiance = shGetIrradianceAt( worldNormal, lightProbe );
	return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ) {
	vec3 irradiance = ambientLightColor;
	return irradiance;
}
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float distanceFalloff = 1.0 / max( pow( lightDistance, decayExponent ), 0.01 );
	if ( cutoffDistance > 0.0 ) {
		distanceFalloff *= pow2( saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) );
	}
	return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	return smoothstep( coneCosine, penumbraCosine, angleCosine );
}
#if NUM_SUN_LIGHTS > 0
	struct SunLight {
		vec3 direction;
		vec3 color;
	};
	uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
	void getSunLightInfo( const in SunLight sunLight, out IncidentLight light ) {
		light.color = sunLight.color;
		light.direction = sunLight.direction;
		light.visible = true;
	}
#endif
#if NUM_DIR_LIGHTS > 0
	struct DirectionalLight {
		vec3 direction;
		vec3 color;
	};
	uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
	void getDirectionalLightInfo( const in DirectionalLight directionalLight, out IncidentLight light ) {
		light.color = directionalLight.color;
		light.direction = directionalLight.direction;
		light.visible = true;
	}
#endif
#if NUM_POINT_LIGHTS > 0
	struct PointLight {
		vec3 position;
		vec3 color;
		float distance;
		float decay;
	};
	uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
	void getPointLightInfo( const in PointLight pointLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = pointLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float lightDistance = length( lVector );
		light.color = pointLight.color;
		light.color *= getDistanceAttenuation( lightDistance, pointLight.distance, pointLight.decay );
		light.visible = ( light.color != vec3( 0.0 ) );
	}
#endif
#if NUM_SPOT_LIGHTS > 0
	struct SpotLight {
		vec3 position;
		vec3 direction;
		vec3 color;
		float distance;
		float decay;
		float coneCos;
		float penumbraCos;
	};
	uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
	void getSpotLightInfo( const in SpotLight spotLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = spotLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float angleCos = dot( light.direction, spotLight.direction );
		float spotAttenuation = getSpotAttenuation( spotLight.coneCos, spotLight.penumbraCos, angleCos );
		if ( spotAttenuation > 0.0 ) {
			float lightDistance = length( lVector );
			light.color = spotLight.color * spotAttenuation;
			light.color *= getDistanceAttenuation( lightDistance, spotLight.distance, spotLight.decay );
			light.visible = ( light.color != vec3( 0.0 ) );
		} else {
			light.color = vec3( 0.0 );
			light.visible = false;
		}
	}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
	struct RectAreaLight {
		vec3 color;
		vec3 position;
		vec3 halfWidth;
		vec3 halfHeight;
	};
	uniform sampler2D ltc_1;	uniform sampler2D ltc_2;
	uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
	struct HemisphereLight {
		vec3 direction;
		vec3 skyColor;
		vec3 groundColor;
	};
	uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
	vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight, const in vec3 normal ) {
		float dotNL = dot( normal, hemiLight.direction );
		float hemiDiffuseWeight = 0.5 * dotNL + 0.5;
		vec3 irradiance = mix( hemiLight.groundColor, hemiLight.skyColor, hemiDiffuseWeight );
		return irradiance;
	}
#endif
#include <lightprobes_pars_fragment>`,GS=`#ifdef USE_ENVMAP
	vec3 getIBLIrradiance( const in vec3 normal ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * worldNormal, ENVMAP_MAX_LOD );
			return PI * envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	vec3 getIBLRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 reflectVec = reflect( - viewDir, normal );
			reflectVec = normalize( mix( reflectVec, normal, pow4( roughness ) ) );
			reflectVec = transformDirectionByInverseViewMatrix( reflectVec, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * reflectVec, roughnessToMip( roughness ) );
			return envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	#ifdef USE_RETROREFLECTION
		vec3 getIBLRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 retroVec = normalize( mix( viewDir, normal, pow4( roughness ) ) );
				retroVec = transformDirectionByInverseViewMatrix( retroVec, viewMatrix );
				vec4 envMapColor = textureLod( envMap, envMapRotation * retroVec, roughnessToMip( roughness ) );
				return envMapColor.rgb * envMapIntensity;
			#else
				return vec3( 0.0 );
			#endif
		}
	#endif
	#ifdef USE_ANISOTROPY
		vec3 getIBLAnisotropyRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 bentNormal = cross( bitangent, viewDir );
				bentNormal = normalize( cross( bentNormal, bitangent ) );
				bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
				return getIBLRadiance( viewDir, bentNormal, roughness );
			#else
				return vec3( 0.0 );
			#endif
		}
		#ifdef USE_RETROREFLECTION
			vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
				#ifdef ENVMAP_TYPE_PMREM
					vec3 bentNormal = cross( bitangent, viewDir );
					bentNormal = normalize( cross( bentNormal, bitangent ) );
					bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
					return getIBLRetroRadiance( viewDir, bentNormal, roughness );
				#else
					return vec3( 0.0 );
				#endif
			}
		#endif
	#endif
#endif`,HS=`ToonMaterial material;
material.diffuseColor = diffuseColor.rgb;`,WS=`varying vec3 vViewPosition;
struct ToonMaterial {
	vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 irradiance = getGradientIrradiance( geometryNormal, directLight.direction ) * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon`,XS=`BlinnPhongMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularColor = specular;
material.specularShininess = shininess;
material.specularStrength = specularStrength;`,qS=`varying vec3 vViewPosition;
struct BlinnPhongMaterial {
	vec3 diffuseColor;
	vec3 specularColor;
	float specularShininess;
	float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
	reflectedLight.directSpecular += irradiance * BRDF_BlinnPhong( directLight.direction, geometryViewDir, geometryNormal, material.specularColor, material.specularShininess ) * material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong`,YS=`PhysicalMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.diffuseContribution = diffuseColor.rgb * ( 1.0 - metalnessFactor );
material.metalness = metalnessFactor;
vec3 dxy = max( abs( dFdx( nonPerturbedNormal ) ), abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness = max( max( dxy.x, dxy.y ), dxy.z );
material.roughness = max( roughnessFactor, 0.045 );
material.roughness += geometryRoughness;
material.roughness = min( material.roughness, 1.0 );
#ifdef USE_DIFFUSE_ROUGHNESS
	float diffuseRoughnessFactor = diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		diffuseRoughnessFactor *= texture2D( diffuseRoughnessMap, vDiffuseRoughnessMapUv ).r;
	#endif
	material.diffuseRoughness = saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
	material.ior = ior;
	#ifdef USE_SPECULAR
		float specularIntensityFactor = specularIntensity;
		vec3 specularColorFactor = specularColor;
		#ifdef USE_SPECULAR_COLORMAP
			specularColorFactor *= texture2D( specularColorMap, vSpecularColorMapUv ).rgb;
		#endif
		#ifdef USE_SPECULAR_INTENSITYMAP
			specularIntensityFactor *= texture2D( specularIntensityMap, vSpecularIntensityMapUv ).a;
		#endif
		material.specularF90 = mix( specularIntensityFactor, 1.0, metalnessFactor );
	#else
		float specularIntensityFactor = 1.0;
		vec3 specularColorFactor = vec3( 1.0 );
		material.specularF90 = 1.0;
	#endif
	material.specularColor = min( pow2( ( material.ior - 1.0 ) / ( material.ior + 1.0 ) ) * specularColorFactor, vec3( 1.0 ) ) * specularIntensityFactor;
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
#else
	material.specularColor = vec3( 0.04 );
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
	material.specularF90 = 1.0;
#endif
#ifdef USE_CLEARCOAT
	material.clearcoat = clearcoat;
	material.clearcoatRoughness = clearcoatRoughness;
	material.clearcoatF0 = vec3( 0.04 );
	material.clearcoatF90 = 1.0;
	#ifdef USE_CLEARCOATMAP
		material.clearcoat *= texture2D( clearcoatMap, vClearcoatMapUv ).x;
	#endif
	#ifdef USE_CLEARCOAT_ROUGHNESSMAP
		material.clearcoatRoughness *= texture2D( clearcoatRoughnessMap, vClearcoatRoughnessMapUv ).y;
	#endif
	material.clearcoat = saturate( material.clearcoat );	material.clearcoatRoughness = max( material.clearcoatRoughness, 0.045 );
	material.clearcoatRoughness += geometryRoughness;
	material.clearcoatRoughness = min( material.clearcoatRoughness, 1.0 );
#endif
#ifdef USE_DISPERSION
	material.dispersion = dispersion;
#endif
#ifdef USE_RETROREFLECTION
	material.retroreflectivity = retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	material.iridescence = iridescence;
	material.iridescenceIOR = iridescenceIOR;
	#ifdef USE_IRIDESCENCEMAP
		material.iridescence *= texture2D( iridescenceMap, vIridescenceMapUv ).r;
	#endif
	#ifdef USE_IRIDESCENCE_THICKNESSMAP
		material.iridescenceThickness = (iridescenceThicknessMaximum - iridescenceThicknessMinimum) * texture2D( iridescenceThicknessMap, vIridescenceThicknessMapUv ).g + iridescenceThicknessMinimum;
	#else
		material.iridescenceThickness = iridescenceThicknessMaximum;
	#endif
#endif
#ifdef USE_SHEEN
	material.sheenColor = sheenColor;
	#ifdef USE_SHEEN_COLORMAP
		material.sheenColor *= texture2D( sheenColorMap, vSheenColorMapUv ).rgb;
	#endif
	material.sheenRoughness = clamp( sheenRoughness, 0.0001, 1.0 );
	#ifdef USE_SHEEN_ROUGHNESSMAP
		material.sheenRoughness *= texture2D( sheenRoughnessMap, vSheenRoughnessMapUv ).a;
	#endif
#endif
#ifdef USE_ANISOTROPY
	#ifdef USE_ANISOTROPYMAP
		mat2 anisotropyMat = mat2( anisotropyVector.x, anisotropyVector.y, - anisotropyVector.y, anisotropyVector.x );
		vec3 anisotropyPolar = texture2D( anisotropyMap, vAnisotropyMapUv ).rgb;
		vec2 anisotropyV = anisotropyMat * normalize( 2.0 * anisotropyPolar.rg - vec2( 1.0 ) ) * anisotropyPolar.b;
	#else
		vec2 anisotropyV = anisotropyVector;
	#endif
	material.anisotropy = length( anisotropyV );
	if( material.anisotropy == 0.0 ) {
		anisotropyV = vec2( 1.0, 0.0 );
	} else {
		anisotropyV /= material.anisotropy;
		material.anisotropy = saturate( material.anisotropy );
	}
	material.alphaT = mix( pow2( material.roughness ), 1.0, pow2( material.anisotropy ) );
	material.anisotropyT = tbn[ 0 ] * anisotropyV.x + tbn[ 1 ] * anisotropyV.y;
	material.anisotropyB = tbn[ 1 ] * anisotropyV.x - tbn[ 0 ] * anisotropyV.y;
#endif`,$S=`uniform sampler2D dfgLUT;
struct PhysicalMaterial {
	vec3 diffuseColor;
	vec3 diffuseContribution;
	vec3 specularColor;
	vec3 specularColorBlended;
	float roughness;
	float metalness;
	float specularF90;
	float dispersion;
	vec2 dfg;
	vec3 multiScatteringCompensation;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float diffuseRoughness;
	#endif
	#ifdef USE_RETROREFLECTION
		float retroreflectivity;
	#endif
	#ifdef USE_CLEARCOAT
		float clearcoat;
		float clearcoatRoughness;
		vec3 clearcoatF0;
		float clearcoatF90;
	#endif
	#ifdef USE_IRIDESCENCE
		float iridescence;
		float iridescenceIOR;
		float iridescenceThickness;
		vec3 iridescenceFresnel;
		vec3 iridescenceF0Dielectric;
		vec3 iridescenceF0Metallic;
	#endif
	#ifdef USE_SHEEN
		vec3 sheenColor;
		float sheenRoughness;
	#endif
	#ifdef IOR
		float ior;
	#endif
	#ifdef USE_TRANSMISSION
		float transmission;
		float transmissionAlpha;
		float thickness;
		float attenuationDistance;
		vec3 attenuationColor;
	#endif
	#ifdef USE_ANISOTROPY
		float anisotropy;
		float alphaT;
		vec3 anisotropyT;
		vec3 anisotropyB;
	#endif
};
vec3 clearcoatSpecularDirect = vec3( 0.0 );
vec3 clearcoatSpecularIndirect = vec3( 0.0 );
vec3 sheenSpecularDirect = vec3( 0.0 );
vec3 sheenSpecularIndirect = vec3(0.0 );
vec3 Schlick_to_F0( const in vec3 f, const in float f90, const in float dotVH ) {
    float x = clamp( 1.0 - dotVH, 0.0, 1.0 );
    float x2 = x * x;
    float x5 = clamp( x * x2 * x2, 0.0, 0.9999 );
    return ( f - vec3( f90 ) * x5 ) / ( 1.0 - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
	const float EON_EPSILON = 1e-7;
	float FON_DirectionalAlbedo( const in float mu, const in float roughness, const in float A ) {
		float muComp = 1.0 - mu;
		float gOverPi = muComp * ( 0.0571085289 + muComp * ( 0.491881867 + muComp * ( - 0.332181442 + muComp * 0.0714429953 ) ) );
		return A * ( 1.0 + roughness * gOverPi );
	}
	vec3 BRDF_EON( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 diffuseColor, const in float roughness ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return BRDF_Lambert( rho );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float s = dot( lightDir, viewDir ) - dotNL * dotNV;
		float sOverT = ( s > 0.0 ) ? s / max( max( dotNL, dotNV ), EON_EPSILON ) : s;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		vec3 singleScatter = rho * RECIPROCAL_PI * A * ( 1.0 + roughness * sOverT );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		float albedoV = FON_DirectionalAlbedo( dotNV, roughness, A );
		float albedoL = FON_DirectionalAlbedo( dotNL, roughness, A );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		vec3 multiScatter = rhoMultiScatter * RECIPROCAL_PI
			* max( EON_EPSILON, 1.0 - albedoV )
			* max( EON_EPSILON, 1.0 - albedoL )
			/ max( EON_EPSILON, 1.0 - averageAlbedo );
		return singleScatter + multiScatter;
	}
	vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor, const in float roughness, const in float dotNV ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return rho;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		float directionalAlbedo = FON_DirectionalAlbedo( dotNV, roughness, A );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		return rho * directionalAlbedo + rhoMultiScatter * ( 1.0 - directionalAlbedo );
	}
#endif
float V_GGX_SmithCorrelated( const in float alpha, const in float dotNL, const in float dotNV ) {
	float a2 = pow2( alpha );
	float gv = dotNL * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNV ) );
	float gl = dotNV * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNL ) );
	return 0.5 / max( gv + gl, EPSILON );
}
float D_GGX( const in float alpha, const in float dotNH ) {
	float a2 = pow2( alpha );
	float denom = pow2( dotNH ) * ( a2 - 1.0 ) + 1.0;
	return RECIPROCAL_PI * a2 / pow2( denom );
}
#ifdef USE_ANISOTROPY
	float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT, const in float alphaB, const in float dotTV, const in float dotBV, const in float dotTL, const in float dotBL, const in float dotNV, const in float dotNL ) {
		float gv = dotNL * length( vec3( alphaT * dotTV, alphaB * dotBV, dotNV ) );
		float gl = dotNV * length( vec3( alphaT * dotTL, alphaB * dotBL, dotNL ) );
		return 0.5 / max( gv + gl, EPSILON );
	}
	float D_GGX_Anisotropic( const in float alphaT, const in float alphaB, const in float dotNH, const in float dotTH, const in float dotBH ) {
		float a2 = alphaT * alphaB;
		highp vec3 v = vec3( alphaB * dotTH, alphaT * dotBH, a2 * dotNH );
		highp float v2 = dot( v, v );
		float w2 = a2 / v2;
		return RECIPROCAL_PI * a2 * pow2 ( w2 );
	}
#endif
#ifdef USE_CLEARCOAT
	vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material) {
		vec3 f0 = material.clearcoatF0;
		float f90 = material.clearcoatF90;
		float roughness = max( material.clearcoatRoughness, 0.045 );
		float alpha = pow2( roughness );
		vec3 halfDir = normalize( lightDir + viewDir );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float dotNH = saturate( dot( normal, halfDir ) );
		float dotVH = saturate( dot( viewDir, halfDir ) );
		vec3 F = F_Schlick( f0, f90, dotVH );
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
		return F * ( V * D );
	}
#endif
vec3 BRDF_GGX( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material ) {
	vec3 f0 = material.specularColorBlended;
	float f90 = material.specularF90;
	float roughness = max( material.roughness, 0.045 );
	float alpha = pow2( roughness );
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( f0, f90, dotVH );
	#ifdef USE_IRIDESCENCE
		F = mix( F, material.iridescenceFresnel, material.iridescence );
	#endif
	#ifdef USE_ANISOTROPY
		float dotTL = dot( material.anisotropyT, lightDir );
		float dotTV = dot( material.anisotropyT, viewDir );
		float dotTH = dot( material.anisotropyT, halfDir );
		float dotBL = dot( material.anisotropyB, lightDir );
		float dotBV = dot( material.anisotropyB, viewDir );
		float dotBH = dot( material.anisotropyB, halfDir );
		float alphaT = max( material.alphaT, alpha );
		float V = V_GGX_SmithCorrelated_Anisotropic( alphaT, alpha, dotTV, dotBV, dotTL, dotBL, dotNV, dotNL );
		float D = D_GGX_Anisotropic( alphaT, alpha, dotNH, dotTH, dotBH );
	#else
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
	#endif
	return F * ( V * D );
}
vec2 LTC_Uv( const in vec3 N, const in vec3 V, const in float roughness ) {
	const float LUT_SIZE = 64.0;
	const float LUT_SCALE = ( LUT_SIZE - 1.0 ) / LUT_SIZE;
	const float LUT_BIAS = 0.5 / LUT_SIZE;
	float dotNV = saturate( dot( N, V ) );
	vec2 uv = vec2( roughness, sqrt( 1.0 - dotNV ) );
	uv = uv * LUT_SCALE + LUT_BIAS;
	return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ) {
	float l = length( f );
	return max( ( l * l + f.z ) / ( l + 1.0 ), 0.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1, const in vec3 v2 ) {
	float x = dot( v1, v2 );
	float y = abs( x );
	float a = 0.8543985 + ( 0.4965155 + 0.0145206 * y ) * y;
	float b = 3.4175940 + ( 4.1616724 + y ) * y;
	float v = a / b;
	float theta_sintheta = ( x > 0.0 ) ? v : 0.5 * inversesqrt( max( 1.0 - x * x, 1e-7 ) ) - v;
	return cross( v1, v2 ) * theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N, const in vec3 V, const in vec3 P, const in mat3 mInv, const in vec3 rectCoords[ 4 ] ) {
	vec3 v1 = rectCoords[ 1 ] - rectCoords[ 0 ];
	vec3 v2 = rectCoords[ 3 ] - rectCoords[ 0 ];
	vec3 lightNormal = cross( v1, v2 );
	if( dot( lightNormal, P - rectCoords[ 0 ] ) < 0.0 ) return vec3( 0.0 );
	vec3 T1, T2;
	T1 = normalize( V - N * dot( V, N ) );
	T2 = - cross( N, T1 );
	mat3 mat = mInv * transpose( mat3( T1, T2, N ) );
	vec3 coords[ 4 ];
	coords[ 0 ] = mat * ( rectCoords[ 0 ] - P );
	coords[ 1 ] = mat * ( rectCoords[ 1 ] - P );
	coords[ 2 ] = mat * ( rectCoords[ 2 ] - P );
	coords[ 3 ] = mat * ( rectCoords[ 3 ] - P );
	coords[ 0 ] = normalize( coords[ 0 ] );
	coords[ 1 ] = normalize( coords[ 1 ] );
	coords[ 2 ] = normalize( coords[ 2 ] );
	coords[ 3 ] = normalize( coords[ 3 ] );
	vec3 vectorFormFactor = vec3( 0.0 );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 0 ], coords[ 1 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 1 ], coords[ 2 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 2 ], coords[ 3 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 3 ], coords[ 0 ] );
	float result = LTC_ClippedSphereFormFactor( vectorFormFactor );
	return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness, float dotNH ) {
	float alpha = pow2( roughness );
	float invAlpha = 1.0 / alpha;
	float cos2h = dotNH * dotNH;
	float sin2h = max( 1.0 - cos2h, 0.0078125 );
	return ( 2.0 + invAlpha ) * pow( sin2h, invAlpha * 0.5 ) / ( 2.0 * PI );
}
float V_Neubelt( float dotNV, float dotNL ) {
	return saturate( 1.0 / ( 4.0 * ( dotNL + dotNV - dotNL * dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, vec3 sheenColor, const in float sheenRoughness ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float D = D_Charlie( sheenRoughness, dotNH );
	float V = V_Neubelt( dotNV, dotNL );
	return sheenColor * ( D * V );
}
#endif
float IBLSheenBRDF( const in vec3 normal, const in vec3 viewDir, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	float r2 = roughness * roughness;
	float rInv = 1.0 / ( roughness + 0.1 );
	float a = -1.9362 + 1.0678 * roughness + 0.4573 * r2 - 0.8469 * rInv;
	float b = -0.6014 + 0.5538 * roughness - 0.4670 * r2 - 0.1255 * rInv;
	float DG = exp( a * dotNV + b );
	return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal, const in vec3 viewDir, const in vec3 specularColor, const in float specularF90, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	vec2 fab = texture2D( dfgLUT, vec2( roughness, dotNV ) ).rg;
	return specularColor * fab.x + specularF90 * fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab, const in vec3 specularColor, const in float specularF90, const in float iridescence, const in vec3 iridescenceF0, inout vec3 singleScatter, inout vec3 multiScatter ) {
#else
void computeMultiscattering( const in vec2 fab, const in vec3 specularColor, const in float specularF90, inout vec3 singleScatter, inout vec3 multiScatter ) {
#endif
	#ifdef USE_IRIDESCENCE
		vec3 Fr = mix( specularColor, iridescenceF0, iridescence );
	#else
		vec3 Fr = specularColor;
	#endif
	vec3 FssEss = Fr * fab.x + specularF90 * fab.y;
	float Ess = fab.x + fab.y;
	float Ems = 1.0 - Ess;
	vec3 Favg = Fr + ( 1.0 - Fr ) * 0.047619;	vec3 Fms = FssEss * Favg / ( 1.0 - Ems * Favg );
	singleScatter += FssEss;
	multiScatter += Fms * Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
	void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
		vec3 normal = geometryNormal;
		vec3 viewDir = geometryViewDir;
		vec3 position = geometryPosition;
		vec3 lightPos = rectAreaLight.position;
		vec3 halfWidth = rectAreaLight.halfWidth;
		vec3 halfHeight = rectAreaLight.halfHeight;
		vec3 lightColor = rectAreaLight.color;
		float roughness = material.roughness;
		vec3 rectCoords[ 4 ];
		rectCoords[ 0 ] = lightPos + halfWidth - halfHeight;		rectCoords[ 1 ] = lightPos - halfWidth - halfHeight;
		rectCoords[ 2 ] = lightPos - halfWidth + halfHeight;
		rectCoords[ 3 ] = lightPos + halfWidth + halfHeight;
		vec2 uv = LTC_Uv( normal, viewDir, roughness );
		vec4 t1 = texture2D( ltc_1, uv );
		vec4 t2 = texture2D( ltc_2, uv );
		mat3 mInv = mat3(
			vec3( t1.x, 0, t1.y ),
			vec3(    0, 1,    0 ),
			vec3( t1.z, 0, t1.w )
		);
		vec3 fresnel = ( material.specularColorBlended * t2.x + ( material.specularF90 - material.specularColorBlended ) * t2.y );
		reflectedLight.directSpecular += lightColor * fresnel * LTC_Evaluate( normal, viewDir, position, mInv, rectCoords );
		reflectedLight.directDiffuse += lightColor * material.diffuseContribution * LTC_Evaluate( normal, viewDir, position, mat3( 1.0 ), rectCoords );
		#ifdef USE_CLEARCOAT
			vec3 Ncc = geometryClearcoatNormal;
			vec2 uvClearcoat = LTC_Uv( Ncc, viewDir, material.clearcoatRoughness );
			vec4 t1Clearcoat = texture2D( ltc_1, uvClearcoat );
			vec4 t2Clearcoat = texture2D( ltc_2, uvClearcoat );
			mat3 mInvClearcoat = mat3(
				vec3( t1Clearcoat.x, 0, t1Clearcoat.y ),
				vec3(             0, 1,             0 ),
				vec3( t1Clearcoat.z, 0, t1Clearcoat.w )
			);
			vec3 fresnelClearcoat = material.clearcoatF0 * t2Clearcoat.x + ( material.clearcoatF90 - material.clearcoatF0 ) * t2Clearcoat.y;
			clearcoatSpecularDirect += lightColor * fresnelClearcoat * LTC_Evaluate( Ncc, viewDir, position, mInvClearcoat, rectCoords );
		#endif
	}
#endif
void RE_Direct_Physical( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	#ifdef USE_CLEARCOAT
		float dotNLcc = saturate( dot( geometryClearcoatNormal, directLight.direction ) );
		vec3 ccIrradiance = dotNLcc * directLight.color;
		clearcoatSpecularDirect += ccIrradiance * BRDF_GGX_Clearcoat( directLight.direction, geometryViewDir, geometryClearcoatNormal, material );
	#endif
	#ifdef USE_SHEEN
 
 		sheenSpecularDirect += irradiance * BRDF_Sheen( directLight.direction, geometryViewDir, geometryNormal, material.sheenColor, material.sheenRoughness );
 
 		float sheenAlbedoV = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
 		float sheenAlbedoL = IBLSheenBRDF( geometryNormal, directLight.direction, material.sheenRoughness );
 
 		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * max( sheenAlbedoV, sheenAlbedoL );
 
 		irradiance *= sheenEnergyComp;
 
 	#endif
	vec3 specularBRDF = BRDF_GGX( directLight.direction, geometryViewDir, geometryNormal, material );
	#ifdef USE_RETROREFLECTION
		vec3 retroViewDir = reflect( - geometryViewDir, geometryNormal );
		vec3 retroSpecularBRDF = BRDF_GGX( directLight.direction, retroViewDir, geometryNormal, material );
		specularBRDF = mix( specularBRDF, retroSpecularBRDF, saturate( material.retroreflectivity ) );
	#endif
	reflectedLight.directSpecular += irradiance * specularBRDF * material.multiScatteringCompensation;
	vec3 halfDir = normalize( directLight.direction + geometryViewDir );
	float dotVH = saturate( dot( geometryViewDir, halfDir ) );
	vec3 F = F_Schlick( material.specularColor, material.specularF90, dotVH );
	#ifdef USE_RETROREFLECTION
		vec3 retroHalfDir = normalize( directLight.direction + retroViewDir );
		float dotRetroVH = saturate( dot( retroViewDir, retroHalfDir ) );
		vec3 retroF = F_Schlick( material.specularColor, material.specularF90, dotRetroVH );
		F = mix( F, retroF, saturate( material.retroreflectivity ) );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		vec3 diffuseBRDF = BRDF_EON( directLight.direction, geometryViewDir, geometryNormal, material.diffuseColor, material.diffuseRoughness ) * ( 1.0 - material.metalness );
	#else
		vec3 diffuseBRDF = BRDF_Lambert( material.diffuseContribution );
	#endif
	reflectedLight.directDiffuse += irradiance * diffuseBRDF * ( 1.0 - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 singleScattering = vec3( 0.0 );
	vec3 multiScattering = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScattering, multiScattering );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScattering, multiScattering );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuseAlbedo = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness );
		vec3 diffuse = irradiance * RECIPROCAL_PI * diffuseAlbedo * ( 1.0 - singleScattering - multiScattering );
	#else
		vec3 diffuse = irradiance * BRDF_Lambert( material.diffuseContribution ) * ( 1.0 - singleScattering - multiScattering );
	#endif
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		sheenSpecularIndirect += irradiance * material.sheenColor * sheenAlbedo * RECIPROCAL_PI;
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		diffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectDiffuse += diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
	#ifdef USE_CLEARCOAT
		clearcoatSpecularIndirect += clearcoatRadiance * EnvironmentBRDF( geometryClearcoatNormal, geometryViewDir, material.clearcoatF0, material.clearcoatF90, material.clearcoatRoughness );
	#endif
	#ifdef USE_SHEEN
		sheenSpecularIndirect += irradiance * material.sheenColor * IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness ) * RECIPROCAL_PI;
 	#endif
	vec3 singleScatteringDielectric = vec3( 0.0 );
	vec3 multiScatteringDielectric = vec3( 0.0 );
	vec3 singleScatteringMetallic = vec3( 0.0 );
	vec3 multiScatteringMetallic = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscatteringIridescence( material.dfg, material.diffuseColor, material.specularF90, material.iridescence, material.iridescenceF0Metallic, singleScatteringMetallic, multiScatteringMetallic );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscattering( material.dfg, material.diffuseColor, material.specularF90, singleScatteringMetallic, multiScatteringMetallic );
	#endif
	vec3 singleScattering = mix( singleScatteringDielectric, singleScatteringMetallic, material.metalness );
	vec3 multiScattering = mix( multiScatteringDielectric, multiScatteringMetallic, material.metalness );
	vec3 totalScatteringDielectric = singleScatteringDielectric + multiScatteringDielectric;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuse = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness ) * ( 1.0 - totalScatteringDielectric );
	#else
		vec3 diffuse = material.diffuseContribution * ( 1.0 - totalScatteringDielectric );
	#endif
	vec3 cosineWeightedIrradiance = irradiance * RECIPROCAL_PI;
	vec3 indirectSpecular = radiance * singleScattering;
	indirectSpecular += multiScattering * cosineWeightedIrradiance;
	vec3 indirectDiffuse = diffuse * cosineWeightedIrradiance;
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		indirectSpecular *= sheenEnergyComp;
		indirectDiffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectSpecular += indirectSpecular;
	reflectedLight.indirectDiffuse += indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV, const in float ambientOcclusion, const in float roughness ) {
	return saturate( pow( dotNV + ambientOcclusion, exp2( - 16.0 * roughness - 1.0 ) ) - 1.0 + ambientOcclusion );
}`,ZS=`
vec3 geometryPosition = - vViewPosition;
vec3 geometryNormal = normal;
vec3 geometryViewDir = ( isOrthographic ) ? vec3( 0, 0, 1 ) : normalize( vViewPosition );
vec3 geometryClearcoatNormal = vec3( 0.0 );
#ifdef USE_CLEARCOAT
	geometryClearcoatNormal = clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
	float dotNVi = saturate( dot( normal, geometryViewDir ) );
	if ( material.iridescenceThickness == 0.0 ) {
		material.iridescence = 0.0;
	} else {
		material.iridescence = saturate( material.iridescence );
	}
	if ( material.iridescence > 0.0 ) {
		vec3 iridescenceFresnelDielectric = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.specularColor );
		vec3 iridescenceFresnelMetallic = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.diffuseColor );
		material.iridescenceFresnel = mix( iridescenceFresnelDielectric, iridescenceFresnelMetallic, material.metalness );
		material.iridescenceF0Dielectric = Schlick_to_F0( iridescenceFresnelDielectric, 1.0, dotNVi );
		material.iridescenceF0Metallic = Schlick_to_F0( iridescenceFresnelMetallic, 1.0, dotNVi );
	}
#endif
#ifdef STANDARD
	float dotNVms = saturate( dot( geometryNormal, geometryViewDir ) );
	material.dfg = texture2D( dfgLUT, vec2( material.roughness, dotNVms ) ).rg;
	#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
		float EssMs = material.dfg.x + material.dfg.y;
		material.multiScatteringCompensation = 1.0 + material.specularColorBlended * ( 1.0 / EssMs - 1.0 );
	#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
	PointLight pointLight;
	#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
	PointLightShadow pointLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHTS; i ++ ) {
		pointLight = pointLights[ i ];
		getPointLightInfo( pointLight, geometryPosition, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
		pointLightShadow = pointLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getPointShadow( pointShadowMap[ i ], pointLightShadow.shadowMapSize, pointLightShadow.shadowIntensity, pointLightShadow.shadowBias, pointLightShadow.shadowRadius, vPointShadowCoord[ i ], pointLightShadow.shadowCameraNear, pointLightShadow.shadowCameraFar ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
	SpotLight spotLight;
	vec4 spotColor;
	vec3 spotLightCoord;
	bool inSpotLightMap;
	#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHTS; i ++ ) {
		spotLight = spotLights[ i ];
		getSpotLightInfo( spotLight, geometryPosition, directLight );
		#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
		#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
		#else
		#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#endif
		#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
			spotLightCoord = vSpotLightCoord[ i ].xyz / vSpotLightCoord[ i ].w;
			inSpotLightMap = all( lessThan( abs( spotLightCoord * 2. - 1. ), vec3( 1.0 ) ) );
			spotColor = texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ], spotLightCoord.xy );
			directLight.color = inSpotLightMap ? directLight.color * spotColor.rgb : directLight.color;
		#endif
		#undef SPOT_LIGHT_MAP_INDEX
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		spotLightShadow = spotLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( spotShadowMap[ i ], spotLightShadow.shadowMapSize, spotLightShadow.shadowIntensity, spotLightShadow.shadowBias, spotLightShadow.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
	SunLight sunLight;
	#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHTS; i ++ ) {
		sunLight = sunLights[ i ];
		getSunLightInfo( sunLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
		sunLightShadow = sunLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getSunShadow( sunShadowMap[ i ], sunLightShadow, UNROLLED_LOOP_INDEX ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
	DirectionalLight directionalLight;
	#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHTS; i ++ ) {
		directionalLight = directionalLights[ i ];
		getDirectionalLightInfo( directionalLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
		directionalLightShadow = directionalLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( directionalShadowMap[ i ], directionalLightShadow.shadowMapSize, directionalLightShadow.shadowIntensity, directionalLightShadow.shadowBias, directionalLightShadow.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
	RectAreaLight rectAreaLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_RECT_AREA_LIGHTS; i ++ ) {
		rectAreaLight = rectAreaLights[ i ];
		RE_Direct_RectArea( rectAreaLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
	vec3 iblIrradiance = vec3( 0.0 );
	vec3 irradiance = getAmbientLightIrradiance( ambientLightColor );
	#if defined( USE_LIGHT_PROBES )
		irradiance += getLightProbeIrradiance( lightProbe, geometryNormal );
	#endif
	#if ( NUM_HEMI_LIGHTS > 0 )
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_HEMI_LIGHTS; i ++ ) {
			irradiance += getHemisphereLightIrradiance( hemisphereLights[ i ], geometryNormal );
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_LIGHT_PROBE_GRIDS > 0
		vec3 probeWorldPos = ( ( vec4( geometryPosition, 1.0 ) - viewMatrix[ 3 ] ) * viewMatrix ).xyz;
		vec3 probeWorldNormal = transformNormalByInverseViewMatrix( geometryNormal, viewMatrix );
		int probeGrid = - 1;
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( isInsideLightProbeGrid( probeWorldPos, probeWorldNormal, probesMin[ i ], probesMax[ i ], probesResolution[ i ] ) ) probeGrid = UNROLLED_LOOP_INDEX;
		}
		#pragma unroll_loop_end
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( probeGrid == UNROLLED_LOOP_INDEX ) irradiance += getLightProbeGridIrradiance( probesSH[ i ], probesMin[ i ], probesMax[ i ], probesResolution[ i ], probeWorldPos, probeWorldNormal );
		}
		#pragma unroll_loop_end
	#endif
#endif
#if defined( RE_IndirectSpecular )
	vec3 radiance = vec3( 0.0 );
	vec3 clearcoatRadiance = vec3( 0.0 );
#endif`,JS=`#if defined( RE_IndirectDiffuse )
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		vec3 lightMapIrradiance = lightMapTexel.rgb * lightMapIntensity;
		irradiance += lightMapIrradiance;
	#endif
	#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
		#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
			iblIrradiance += getIBLIrradiance( geometryNormal );
		#endif
	#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
	#ifdef USE_ANISOTROPY
		vec3 iblRadiance = getIBLAnisotropyRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
	#else
		vec3 iblRadiance = getIBLRadiance( geometryViewDir, geometryNormal, material.roughness );
	#endif
	#ifdef USE_RETROREFLECTION
		#ifdef USE_ANISOTROPY
			vec3 retroIBLRadiance = getIBLAnisotropyRetroRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
		#else
			vec3 retroIBLRadiance = getIBLRetroRadiance( geometryViewDir, geometryNormal, material.roughness );
		#endif
		iblRadiance = mix( iblRadiance, retroIBLRadiance, saturate( material.retroreflectivity ) );
	#endif
	radiance += iblRadiance;
	#ifdef USE_CLEARCOAT
		clearcoatRadiance += getIBLRadiance( geometryViewDir, geometryClearcoatNormal, material.clearcoatRoughness );
	#endif
#endif`,KS=`#if defined( RE_IndirectDiffuse )
	#if defined( LAMBERT ) || defined( PHONG )
		irradiance += iblIrradiance;
	#endif
	RE_IndirectDiffuse( irradiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
	RE_IndirectSpecular( radiance, iblIrradiance, clearcoatRadiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif`,jS=`#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos, vec3 worldNormal, vec3 probesMin, vec3 probesMax, vec3 probesResolution ) {
	vec3 spacing = ( probesMax - probesMin ) / probesResolution;
	vec3 samplePos = worldPos + worldNormal * spacing * 0.5;
	vec3 margin = spacing * 0.01;
	return all( greaterThanEqual( samplePos, probesMin - margin ) ) && all( lessThanEqual( samplePos, probesMax + margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH, vec3 probesMin, vec3 probesMax, vec3 probesResolution, vec3 worldPos, vec3 worldNormal ) {
	vec3 res = probesResolution;
	vec3 gridRange = probesMax - probesMin;
	vec3 probeSpacing = gridRange / res;
	vec3 samplePos = worldPos + worldNormal * probeSpacing * 0.5;
	vec3 uvw = clamp( ( samplePos - probesMin ) / gridRange, 0.5 / res, 1.0 - 0.5 / res );
	float nz          = res.z;
	float paddedSlices = nz + 2.0;
	float atlasDepth  = 7.0 * paddedSlices;
	float uvZBase     = uvw.z * nz + 1.0;
	vec4 s0 = texture( probesSH, vec3( uvw.xy, ( uvZBase                       ) / atlasDepth ) );
	vec4 s1 = texture( probesSH, vec3( uvw.xy, ( uvZBase +       paddedSlices   ) / atlasDepth ) );
	vec4 s2 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 2.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s3 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 3.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s4 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 4.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s5 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 5.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s6 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 6.0 * paddedSlices   ) / atlasDepth ) );
	vec3 c0 = s0.xyz;
	vec3 c1 = vec3( s0.w, s1.xy );
	vec3 c2 = vec3( s1.zw, s2.x );
	vec3 c3 = s2.yzw;
	vec3 c4 = s3.xyz;
	vec3 c5 = vec3( s3.w, s4.xy );
	vec3 c6 = vec3( s4.zw, s5.x );
	vec3 c7 = s5.yzw;
	vec3 c8 = s6.xyz;
	float x = worldNormal.x, y = worldNormal.y, z = worldNormal.z;
	vec3 result = c0 * 0.886227;
	result += c1 * 2.0 * 0.511664 * y;
	result += c2 * 2.0 * 0.511664 * z;
	result += c3 * 2.0 * 0.511664 * x;
	result += c4 * 2.0 * 0.429043 * x * y;
	result += c5 * 2.0 * 0.429043 * y * z;
	result += c6 * ( 0.743125 * z * z - 0.247708 );
	result += c7 * 2.0 * 0.429043 * x * z;
	result += c8 * 0.429043 * ( x * x - y * y );
	return max( result, vec3( 0.0 ) );
}
#endif`,QS=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	gl_FragDepth = vIsPerspective == 0.0 ? gl_FragCoord.z : log2( vFragDepth ) * logDepthBufFC * 0.5;
#endif`,eM=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	uniform float logDepthBufFC;
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,tM=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,nM=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	vFragDepth = 1.0 + gl_Position.w;
	vIsPerspective = float( isPerspectiveMatrix( projectionMatrix ) );
#endif`,iM=`#ifdef USE_MAP
	vec4 sampledDiffuseColor = texture2D( map, vMapUv );
	#ifdef DECODE_VIDEO_TEXTURE
		sampledDiffuseColor = sRGBTransferEOTF( sampledDiffuseColor );
	#endif
	diffuseColor *= sampledDiffuseColor;
#endif`,sM=`#ifdef USE_MAP
	uniform sampler2D map;
#endif`,rM=`#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
	#if defined( USE_POINTS_UV )
		vec2 uv = vUv;
	#else
		vec2 uv = ( uvTransform * vec3( gl_PointCoord.x, 1.0 - gl_PointCoord.y, 1 ) ).xy;
	#endif
#endif
#ifdef USE_MAP
	diffuseColor *= texture2D( map, uv );
#endif
#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, uv ).g;
#endif`,oM=`#if defined( USE_POINTS_UV )
	varying vec2 vUv;
#else
	#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
		uniform mat3 uvTransform;
	#endif
#endif
#ifdef USE_MAP
	uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,aM=`float metalnessFactor = metalness;
#ifdef USE_METALNESSMAP
	vec4 texelMetalness = texture2D( metalnessMap, vMetalnessMapUv );
	metalnessFactor *= texelMetalness.b;
#endif`,lM=`#ifdef USE_METALNESSMAP
	uniform sampler2D metalnessMap;
#endif`,cM=`#ifdef USE_INSTANCING_MORPH
	float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	float morphTargetBaseInfluence = texelFetch( morphTexture, ivec2( 0, gl_InstanceID ), 0 ).r;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		morphTargetInfluences[i] =  texelFetch( morphTexture, ivec2( i + 1, gl_InstanceID ), 0 ).r;
	}
#endif`,uM=`#if defined( USE_MORPHCOLORS )
	#if defined( USE_COLOR_ALPHA )
		vColor *= morphTargetBaseInfluence;
	#elif defined( USE_COLOR )
		vColor.rgb *= morphTargetBaseInfluence;
	#endif
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		#if defined( USE_COLOR_ALPHA )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor += getMorph( gl_VertexID, i, 2 ) * morphTargetInfluences[ i ];
		#elif defined( USE_COLOR )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor.rgb += getMorph( gl_VertexID, i, 2 ).rgb * morphTargetInfluences[ i ];
		#endif
	}
#endif`,hM=`#ifdef USE_MORPHNORMALS
	objectNormal *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) objectNormal += getMorph( gl_VertexID, i, 1 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,dM=`#ifdef USE_MORPHTARGETS
	#ifndef USE_INSTANCING_MORPH
		uniform float morphTargetBaseInfluence;
		uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	#endif
	uniform sampler2DArray morphTargetsTexture;
	uniform ivec2 morphTargetsTextureSize;
	vec4 getMorph( const in int vertexIndex, const in int morphTargetIndex, const in int offset ) {
		int texelIndex = vertexIndex * MORPHTARGETS_TEXTURE_STRIDE + offset;
		int y = texelIndex / morphTargetsTextureSize.x;
		int x = texelIndex - y * morphTargetsTextureSize.x;
		ivec3 morphUV = ivec3( x, y, morphTargetIndex );
		return texelFetch( morphTargetsTexture, morphUV, 0 );
	}
#endif`,fM=`#ifdef USE_MORPHTARGETS
	transformed *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) transformed += getMorph( gl_VertexID, i, 0 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,pM=`float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;
#ifdef FLAT_SHADED
	vec3 fdx = dFdx( vViewPosition );
	vec3 fdy = dFdy( vViewPosition );
	vec3 normal = normalize( cross( fdx, fdy ) );
#else
	vec3 normal = normalize( vNormal );
	#ifdef DOUBLE_SIDED
		normal *= faceDirection;
	#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
	#ifdef USE_TANGENT
		mat3 tbn = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn = getTangentFrame( - vViewPosition, normal,
		#if defined( USE_NORMALMAP )
			vNormalMapUv
		#elif defined( USE_CLEARCOAT_NORMALMAP )
			vClearcoatNormalMapUv
		#else
			vUv
		#endif
		);
	#endif
	#ifdef DOUBLE_SIDED
		tbn[0] *= faceDirection;
		tbn[1] *= faceDirection;
	#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	#ifdef USE_TANGENT
		mat3 tbn2 = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn2 = getTangentFrame( - vViewPosition, normal, vClearcoatNormalMapUv );
	#endif
	#ifdef DOUBLE_SIDED
		tbn2[0] *= faceDirection;
		tbn2[1] *= faceDirection;
	#endif
#endif
vec3 nonPerturbedNormal = normal;`,mM=`#ifdef USE_NORMALMAP_OBJECTSPACE
	normal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#ifdef FLIP_SIDED
		normal = - normal;
	#endif
	#ifdef DOUBLE_SIDED
		normal = normal * faceDirection;
	#endif
	normal = normalize( normalMatrix * normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
	vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#if defined( USE_PACKED_NORMALMAP )
		mapN = vec3( mapN.xy, sqrt( saturate( 1.0 - dot( mapN.xy, mapN.xy ) ) ) );
	#endif
	mapN.xy *= normalScale;
	normal = normalize( tbn * mapN );
#elif defined( USE_BUMPMAP )
	normal = perturbNormalArb( - vViewPosition, normal, dHdxy_fwd(), faceDirection );
#endif`,gM=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,_M=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,vM=`#ifndef FLAT_SHADED
	vNormal = normalize( transformedNormal );
	#ifdef USE_TANGENT
		vTangent = normalize( transformedTangent );
		vBitangent = normalize( cross( vNormal, vTangent ) * tangent.w );
		#ifdef FLIP_SIDED
			vBitangent = - vBitangent;
		#endif
	#endif
#endif`,xM=`#ifdef USE_NORMALMAP
	uniform sampler2D normalMap;
	uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
	uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
	mat3 getTangentFrame( vec3 eye_pos, vec3 surf_norm, vec2 uv ) {
		vec3 q0 = dFdx( eye_pos.xyz );
		vec3 q1 = dFdy( eye_pos.xyz );
		vec2 st0 = dFdx( uv.st );
		vec2 st1 = dFdy( uv.st );
		vec3 N = surf_norm;
		vec3 q1perp = cross( q1, N );
		vec3 q0perp = cross( N, q0 );
		vec3 T = q1perp * st0.x + q0perp * st1.x;
		vec3 B = q1perp * st0.y + q0perp * st1.y;
		float det = max( dot( T, T ), dot( B, B ) );
		float scale = ( det == 0.0 ) ? 0.0 : inversesqrt( det );
		return mat3( T * scale, B * scale, N );
	}
#endif`,yM=`#ifdef USE_CLEARCOAT
	vec3 clearcoatNormal = nonPerturbedNormal;
#endif`,bM=`#ifdef USE_CLEARCOAT_NORMALMAP
	vec3 clearcoatMapN = texture2D( clearcoatNormalMap, vClearcoatNormalMapUv ).xyz * 2.0 - 1.0;
	clearcoatMapN.xy *= clearcoatNormalScale;
	clearcoatNormal = normalize( tbn2 * clearcoatMapN );
#endif`,SM=`#ifdef USE_CLEARCOATMAP
	uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform sampler2D clearcoatNormalMap;
	uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform sampler2D clearcoatRoughnessMap;
#endif`,MM=`#ifdef USE_IRIDESCENCEMAP
	uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform sampler2D iridescenceThicknessMap;
#endif`,wM=`#ifdef OPAQUE
diffuseColor.a = 1.0;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a *= material.transmissionAlpha;
#endif
gl_FragColor = vec4( outgoingLight, diffuseColor.a );`,TM=`vec3 packNormalToRGB( const in vec3 normal ) {
	return normalize( normal ) * 0.5 + 0.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ) {
	return 2.0 * rgb.xyz - 1.0;
}
const float PackUpscale = 256. / 255.;const float UnpackDownscale = 255. / 256.;const float ShiftRight8 = 1. / 256.;
const float Inv255 = 1. / 255.;
const vec4 PackFactors = vec4( 1.0, 256.0, 256.0 * 256.0, 256.0 * 256.0 * 256.0 );
const vec2 UnpackFactors2 = vec2( UnpackDownscale, 1.0 / PackFactors.g );
const vec3 UnpackFactors3 = vec3( UnpackDownscale / PackFactors.rg, 1.0 / PackFactors.b );
const vec4 UnpackFactors4 = vec4( UnpackDownscale / PackFactors.rgb, 1.0 / PackFactors.a );
vec4 packDepthToRGBA( const in float v ) {
	if( v <= 0.0 )
		return vec4( 0., 0., 0., 0. );
	if( v >= 1.0 )
		return vec4( 1., 1., 1., 1. );
	float vuf;
	float af = modf( v * PackFactors.a, vuf );
	float bf = modf( vuf * ShiftRight8, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec4( vuf * Inv255, gf * PackUpscale, bf * PackUpscale, af );
}
vec3 packDepthToRGB( const in float v ) {
	if( v <= 0.0 )
		return vec3( 0., 0., 0. );
	if( v >= 1.0 )
		return vec3( 1., 1., 1. );
	float vuf;
	float bf = modf( v * PackFactors.b, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec3( vuf * Inv255, gf * PackUpscale, bf );
}
vec2 packDepthToRG( const in float v ) {
	if( v <= 0.0 )
		return vec2( 0., 0. );
	if( v >= 1.0 )
		return vec2( 1., 1. );
	float vuf;
	float gf = modf( v * 256., vuf );
	return vec2( vuf * Inv255, gf );
}
float unpackRGBAToDepth( const in vec4 v ) {
	return dot( v, UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ) {
	return dot( v, UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ) {
	return v.r * UnpackFactors2.r + v.g * UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ) {
	vec4 r = vec4( v.x, fract( v.x * 255.0 ), v.y, fract( v.y * 255.0 ) );
	return vec4( r.x - r.y / 255.0, r.y, r.z - r.w / 255.0, r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ) {
	return vec2( v.x + ( v.y / 255.0 ), v.z + ( v.w / 255.0 ) );
}
float viewZToOrthographicDepth( const in float viewZ, const in float near, const in float far ) {
	return ( viewZ + near ) / ( near - far );
}
float orthographicDepthToViewZ( const in float depth, const in float near, const in float far ) {
	#ifdef USE_REVERSED_DEPTH_BUFFER
	
		return depth * ( far - near ) - far;
	#else
		return depth * ( near - far ) - near;
	#endif
}
float viewZToPerspectiveDepth( const in float viewZ, const in float near, const in float far ) {
	return ( ( near + viewZ ) * far ) / ( ( far - near ) * viewZ );
}
float perspectiveDepthToViewZ( const in float depth, const in float near, const in float far ) {
	
	#ifdef USE_REVERSED_DEPTH_BUFFER
		return ( near * far ) / ( ( near - far ) * depth - near );
	#else
		return ( near * far ) / ( ( far - near ) * depth - far );
	#endif
}`,EM=`#ifdef PREMULTIPLIED_ALPHA
	gl_FragColor.rgb *= gl_FragColor.a;
#endif`,AM=`vec4 mvPosition = vec4( transformed, 1.0 );
#ifdef USE_BATCHING
	mvPosition = batchingMatrix * mvPosition;
#endif
#ifdef USE_INSTANCING
	mvPosition = instanceMatrix * mvPosition;
#endif
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;`,CM=`#ifdef DITHERING
	gl_FragColor.rgb = dithering( gl_FragColor.rgb );
#endif`,RM=`#ifdef DITHERING
	vec3 dithering( vec3 color ) {
		float grid_position = rand( gl_FragCoord.xy );
		vec3 dither_shift_RGB = vec3( 0.25 / 255.0, -0.25 / 255.0, 0.25 / 255.0 );
		dither_shift_RGB = mix( 2.0 * dither_shift_RGB, -2.0 * dither_shift_RGB, grid_position );
		return color + dither_shift_RGB;
	}
#endif`,PM=`float roughnessFactor = roughness;
#ifdef USE_ROUGHNESSMAP
	vec4 texelRoughness = texture2D( roughnessMap, vRoughnessMapUv );
	roughnessFactor *= texelRoughness.g;
#endif`,IM=`#ifdef USE_ROUGHNESSMAP
	uniform sampler2D roughnessMap;
#endif`,LM=`#if NUM_SPOT_LIGHT_COORDS > 0
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
	uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		#define SUN_LIGHT_CASCADES 2
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#else
			uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#endif
		uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
		struct SunLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#else
			uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#endif
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#else
			uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#endif
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#elif defined( SHADOWMAP_TYPE_BASIC )
			uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#endif
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float interleavedGradientNoise( vec2 position ) {
			return fract( 52.9829189 * fract( dot( position, vec2( 0.06711056, 0.00583715 ) ) ) );
		}
		vec2 vogelDiskSample( int sampleIndex, int samplesCount, float phi ) {
			const float goldenAngle = 2.399963229728653;
			float r = sqrt( ( float( sampleIndex ) + 0.5 ) / float( samplesCount ) );
			float theta = float( sampleIndex ) * goldenAngle + phi;
			return vec2( cos( theta ), sin( theta ) ) * r;
		}
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float getShadow( sampler2DShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 texelSize = vec2( 1.0 ) / shadowMapSize;
				vec2 radius = shadowRadius * texelSize;
				float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
				shadow = (
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 0, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 1, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 2, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 3, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )
				) * 0.2;
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#elif defined( SHADOWMAP_TYPE_VSM )
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 distribution = texture2D( shadowMap, shadowCoord.xy ).rg;
				float mean = distribution.x;
				float variance = distribution.y * distribution.y;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					float hard_shadow = step( mean, shadowCoord.z );
				#else
					float hard_shadow = step( shadowCoord.z, mean );
				#endif
				
				if ( hard_shadow == 1.0 ) {
					shadow = 1.0;
				} else {
					variance = max( variance, 0.0000001 );
					float d = shadowCoord.z - mean;
					float p_max = variance / ( variance + d * d );
					p_max = clamp( ( p_max - 0.3 ) / 0.65, 0.0, 1.0 );
					shadow = max( hard_shadow, p_max );
				}
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#else
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				float depth = texture2D( shadowMap, shadowCoord.xy ).r;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					shadow = step( depth, shadowCoord.z );
				#else
					shadow = step( shadowCoord.z, depth );
				#endif
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#endif
	#if NUM_SUN_LIGHT_SHADOWS > 0
		float getSunShadow(
			#if defined( SHADOWMAP_TYPE_PCF )
				sampler2DShadow shadowMap,
			#else
				sampler2D shadowMap,
			#endif
			SunLightShadow sunLightShadow,
			int shadowIndex
		) {
			vec4 shadowWorldPosition = vec4( vSunShadowWorldPosition.xyz + vSunShadowWorldNormal * sunLightShadow.shadowNormalBias, 1.0 );
			float viewDepth = vSunShadowWorldPosition.w;
			int cascadeOffset = shadowIndex * SUN_LIGHT_CASCADES;
			float shadow = 1.0;
			for ( int i = SUN_LIGHT_CASCADES - 1; i >= 0; i -- ) {
				vec4 cascade = sunShadowCascade[ cascadeOffset + i ];
				if ( viewDepth >= cascade.x && viewDepth < cascade.y ) {
					float cascadeShadow = getShadow(
						shadowMap,
						sunLightShadow.shadowMapSize,
						sunLightShadow.shadowIntensity,
						sunLightShadow.shadowBias,
						sunLightShadow.shadowRadius,
						sunShadowMatrix[ cascadeOffset + i ] * shadowWorldPosition
					);
					shadow = mix( cascadeShadow, shadow, smoothstep( cascade.z, cascade.y, viewDepth ) );
				}
			}
			return shadow;
		}
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
	#if defined( SHADOWMAP_TYPE_PCF )
	float getPointShadow( samplerCubeShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 bd3D = normalize( lightToPosition );
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float lightDistance = length( lightToPosition );
			float depthRange = shadowCameraFar - shadowCameraNear;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				float depthA = - shadowCameraNear / depthRange - shadowBias;
				float depthB = shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#else
				float depthA = shadowCameraFar / depthRange + shadowBias;
				float depthB = - shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#endif
			float texelSize = shadowRadius / shadowMapSize.x;
			vec3 absDir = abs( bd3D );
			vec3 tangent = absDir.x > absDir.z ? vec3( 0.0, 1.0, 0.0 ) : vec3( 1.0, 0.0, 0.0 );
			tangent = normalize( cross( bd3D, tangent ) );
			vec3 bitangent = cross( bd3D, tangent );
			float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
			shadow = 0.0;
			for ( int i = 0; i < 5; i ++ ) {
				vec2 offset = vogelDiskSample( i, 5, phi );
				vec3 direction = bd3D + ( tangent * offset.x + bitangent * offset.y ) * texelSize;
				vec3 absDirection = abs( direction );
				float dp = depthA + depthB / max( max( absDirection.x, absDirection.y ), absDirection.z );
				shadow += texture( shadowMap, vec4( direction, dp ) );
			}
			shadow *= 0.2;
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#elif defined( SHADOWMAP_TYPE_BASIC )
	float getPointShadow( samplerCube shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float dp = ( shadowCameraFar * ( viewSpaceZ - shadowCameraNear ) ) / ( viewSpaceZ * ( shadowCameraFar - shadowCameraNear ) );
			dp += shadowBias;
			vec3 bd3D = normalize( lightToPosition );
			float depth = textureCube( shadowMap, bd3D ).r;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				depth = 1.0 - depth;
			#endif
			shadow = step( dp, depth );
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#endif
	#endif
#endif`,DM=`#if NUM_SPOT_LIGHT_COORDS > 0
	uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
#endif`,NM=`#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
	#ifdef HAS_NORMAL
		vec3 shadowWorldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
	#else
		vec3 shadowWorldNormal = vec3( 0.0 );
	#endif
	vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
	#if NUM_SUN_LIGHT_SHADOWS > 0
		vSunShadowWorldPosition = vec4( worldPosition.xyz, - mvPosition.z );
		vSunShadowWorldNormal = shadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 );
			vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * pointLightShadows[ i ].shadowNormalBias, 0 );
			vPointShadowCoord[ i ] = pointShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_COORDS; i ++ ) {
		shadowWorldPosition = worldPosition;
		#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
			shadowWorldPosition.xyz += shadowWorldNormal * spotLightShadows[ i ].shadowNormalBias;
		#endif
		vSpotLightCoord[ i ] = spotLightMatrix[ i ] * shadowWorldPosition;
	}
	#pragma unroll_loop_end
#endif`,UM=`float getShadowMask() {
	float shadow = 1.0;
	#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHT_SHADOWS; i ++ ) {
		sunLight = sunLightShadows[ i ];
		shadow *= receiveShadow ? getSunShadow( sunShadowMap[ i ], sunLight, UNROLLED_LOOP_INDEX ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
		directionalLight = directionalLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( directionalShadowMap[ i ], directionalLight.shadowMapSize, directionalLight.shadowIntensity, directionalLight.shadowBias, directionalLight.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_SHADOWS; i ++ ) {
		spotLight = spotLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( spotShadowMap[ i ], spotLight.shadowMapSize, spotLight.shadowIntensity, spotLight.shadowBias, spotLight.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
	PointLightShadow pointLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
		pointLight = pointLightShadows[ i ];
		shadow *= receiveShadow ? getPointShadow( pointShadowMap[ i ], pointLight.shadowMapSize, pointLight.shadowIntensity, pointLight.shadowBias, pointLight.shadowRadius, vPointShadowCoord[ i ], pointLight.shadowCameraNear, pointLight.shadowCameraFar ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#endif
	return shadow;
}`,OM=`#ifdef USE_SKINNING
	mat4 boneMatX = getBoneMatrix( skinIndex.x );
	mat4 boneMatY = getBoneMatrix( skinIndex.y );
	mat4 boneMatZ = getBoneMatrix( skinIndex.z );
	mat4 boneMatW = getBoneMatrix( skinIndex.w );
#endif`,FM=`#ifdef USE_SKINNING
	uniform mat4 bindMatrix;
	uniform mat4 bindMatrixInverse;
	uniform highp sampler2D boneTexture;
	mat4 getBoneMatrix( const in float i ) {
		int size = textureSize( boneTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( boneTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( boneTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( boneTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( boneTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
#endif`,kM=`#ifdef USE_SKINNING
	vec4 skinVertex = bindMatrix * vec4( transformed, 1.0 );
	vec4 skinned = vec4( 0.0 );
	skinned += boneMatX * skinVertex * skinWeight.x;
	skinned += boneMatY * skinVertex * skinWeight.y;
	skinned += boneMatZ * skinVertex * skinWeight.z;
	skinned += boneMatW * skinVertex * skinWeight.w;
	transformed = ( bindMatrixInverse * skinned ).xyz;
#endif`,BM=`#ifdef USE_SKINNING
	mat4 skinMatrix = mat4( 0.0 );
	skinMatrix += skinWeight.x * boneMatX;
	skinMatrix += skinWeight.y * boneMatY;
	skinMatrix += skinWeight.z * boneMatZ;
	skinMatrix += skinWeight.w * boneMatW;
	skinMatrix = bindMatrixInverse * skinMatrix * bindMatrix;
	objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;
	#ifdef USE_TANGENT
		objectTangent = vec4( skinMatrix * vec4( objectTangent, 0.0 ) ).xyz;
	#endif
#endif`,zM=`float specularStrength;
#ifdef USE_SPECULARMAP
	vec4 texelSpecular = texture2D( specularMap, vSpecularMapUv );
	specularStrength = texelSpecular.r;
#else
	specularStrength = 1.0;
#endif`,VM=`#ifdef USE_SPECULARMAP
	uniform sampler2D specularMap;
#endif`,GM=`#if defined( TONE_MAPPING )
	gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );
#endif`,HM=`#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ) {
	return saturate( toneMappingExposure * color );
}
vec3 ReinhardToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	return saturate( color / ( vec3( 1.0 ) + color ) );
}
vec3 CineonToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	color = max( vec3( 0.0 ), color - 0.004 );
	return pow( ( color * ( 6.2 * color + 0.5 ) ) / ( color * ( 6.2 * color + 1.7 ) + 0.06 ), vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ) {
	vec3 a = v * ( v + 0.0245786 ) - 0.000090537;
	vec3 b = v * ( 0.983729 * v + 0.4329510 ) + 0.238081;
	return a / b;
}
vec3 ACESFilmicToneMapping( vec3 color ) {
	const mat3 ACESInputMat = mat3(
		vec3( 0.59719, 0.07600, 0.02840 ),		vec3( 0.35458, 0.90834, 0.13383 ),
		vec3( 0.04823, 0.01566, 0.83777 )
	);
	const mat3 ACESOutputMat = mat3(
		vec3(  1.60475, -0.10208, -0.00327 ),		vec3( -0.53108,  1.10813, -0.07276 ),
		vec3( -0.07367, -0.00605,  1.07602 )
	);
	color *= toneMappingExposure / 0.6;
	color = ACESInputMat * color;
	color = RRTAndODTFit( color );
	color = ACESOutputMat * color;
	return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB = mat3(
	vec3( 1.6605, - 0.1246, - 0.0182 ),
	vec3( - 0.5876, 1.1329, - 0.1006 ),
	vec3( - 0.0728, - 0.0083, 1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020 = mat3(
	vec3( 0.6274, 0.0691, 0.0164 ),
	vec3( 0.3293, 0.9195, 0.0880 ),
	vec3( 0.0433, 0.0113, 0.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ) {
	vec3 x2 = x * x;
	vec3 x4 = x2 * x2;
	return + 15.5 * x4 * x2
		- 40.14 * x4 * x
		+ 31.96 * x4
		- 6.868 * x2 * x
		+ 0.4298 * x2
		+ 0.1191 * x
		- 0.00232;
}
vec3 AgXToneMapping( vec3 color ) {
	const mat3 AgXInsetMatrix = mat3(
		vec3( 0.856627153315983, 0.137318972929847, 0.11189821299995 ),
		vec3( 0.0951212405381588, 0.761241990602591, 0.0767994186031903 ),
		vec3( 0.0482516061458583, 0.101439036467562, 0.811302368396859 )
	);
	const mat3 AgXOutsetMatrix = mat3(
		vec3( 1.1271005818144368, - 0.1413297634984383, - 0.14132976349843826 ),
		vec3( - 0.11060664309660323, 1.157823702216272, - 0.11060664309660294 ),
		vec3( - 0.016493938717834573, - 0.016493938717834257, 1.2519364065950405 )
	);
	const float AgxMinEv = - 12.47393;	const float AgxMaxEv = 4.026069;
	color *= toneMappingExposure;
	color = LINEAR_SRGB_TO_LINEAR_REC2020 * color;
	color = AgXInsetMatrix * color;
	color = max( color, 1e-10 );	color = log2( color );
	color = ( color - AgxMinEv ) / ( AgxMaxEv - AgxMinEv );
	color = clamp( color, 0.0, 1.0 );
	color = agxDefaultContrastApprox( color );
	color = AgXOutsetMatrix * color;
	color = pow( max( vec3( 0.0 ), color ), vec3( 2.2 ) );
	color = LINEAR_REC2020_TO_LINEAR_SRGB * color;
	color = clamp( color, 0.0, 1.0 );
	return color;
}
vec3 NeutralToneMapping( vec3 color ) {
	const float StartCompression = 0.8 - 0.04;
	const float Desaturation = 0.15;
	color *= toneMappingExposure;
	float x = min( color.r, min( color.g, color.b ) );
	float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
	color -= offset;
	float peak = max( color.r, max( color.g, color.b ) );
	if ( peak < StartCompression ) return color;
	float d = 1. - StartCompression;
	float newPeak = 1. - d * d / ( peak + d - StartCompression );
	color *= newPeak / peak;
	float g = 1. - 1. / ( Desaturation * ( peak - newPeak ) + 1. );
	return mix( color, vec3( newPeak ), g );
}
vec3 CustomToneMapping( vec3 color ) { return color; }`,WM=`#ifdef USE_TRANSMISSION
	material.transmission = transmission;
	material.transmissionAlpha = 1.0;
	material.thickness = thickness;
	material.attenuationDistance = attenuationDistance;
	material.attenuationColor = attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		material.transmission *= texture2D( transmissionMap, vTransmissionMapUv ).r;
	#endif
	#ifdef USE_THICKNESSMAP
		material.thickness *= texture2D( thicknessMap, vThicknessMapUv ).g;
	#endif
	vec3 pos = vWorldPosition;
	vec3 v = normalize( cameraPosition - pos );
	vec3 n = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec4 transmitted = getIBLVolumeRefraction(
		n, v, material.roughness, material.diffuseContribution, material.specularColorBlended, material.specularF90,
		pos, modelMatrix, viewMatrix, projectionMatrix, material.dispersion, material.ior, material.thickness,
		material.attenuationColor, material.attenuationDistance );
	material.transmissionAlpha = mix( material.transmissionAlpha, transmitted.a, material.transmission );
	totalDiffuse = mix( totalDiffuse, transmitted.rgb, material.transmission );
#endif`,XM=`#ifdef USE_TRANSMISSION
	uniform float transmission;
	uniform float thickness;
	uniform float attenuationDistance;
	uniform vec3 attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		uniform sampler2D transmissionMap;
	#endif
	#ifdef USE_THICKNESSMAP
		uniform sampler2D thicknessMap;
	#endif
	uniform vec2 transmissionSamplerSize;
	uniform sampler2D transmissionSamplerMap;
	uniform mat4 modelMatrix;
	uniform mat4 projectionMatrix;
	varying vec3 vWorldPosition;
	float w0( float a ) {
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - a + 3.0 ) - 3.0 ) + 1.0 );
	}
	float w1( float a ) {
		return ( 1.0 / 6.0 ) * ( a *  a * ( 3.0 * a - 6.0 ) + 4.0 );
	}
	float w2( float a ){
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - 3.0 * a + 3.0 ) + 3.0 ) + 1.0 );
	}
	float w3( float a ) {
		return ( 1.0 / 6.0 ) * ( a * a * a );
	}
	float g0( float a ) {
		return w0( a ) + w1( a );
	}
	float g1( float a ) {
		return w2( a ) + w3( a );
	}
	float h0( float a ) {
		return - 1.0 + w1( a ) / ( w0( a ) + w1( a ) );
	}
	float h1( float a ) {
		return 1.0 + w3( a ) / ( w2( a ) + w3( a ) );
	}
	vec4 bicubic( sampler2D tex, vec2 uv, vec4 texelSize, float lod ) {
		uv = uv * texelSize.zw + 0.5;
		vec2 iuv = floor( uv );
		vec2 fuv = fract( uv );
		float g0x = g0( fuv.x );
		float g1x = g1( fuv.x );
		float h0x = h0( fuv.x );
		float h1x = h1( fuv.x );
		float h0y = h0( fuv.y );
		float h1y = h1( fuv.y );
		vec2 p0 = ( vec2( iuv.x + h0x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p1 = ( vec2( iuv.x + h1x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p2 = ( vec2( iuv.x + h0x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		vec2 p3 = ( vec2( iuv.x + h1x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		return g0( fuv.y ) * ( g0x * textureLod( tex, p0, lod ) + g1x * textureLod( tex, p1, lod ) ) +
			g1( fuv.y ) * ( g0x * textureLod( tex, p2, lod ) + g1x * textureLod( tex, p3, lod ) );
	}
	vec4 textureBicubic( sampler2D sampler, vec2 uv, float lod ) {
		vec2 fLodSize = vec2( textureSize( sampler, int( lod ) ) );
		vec2 cLodSize = vec2( textureSize( sampler, int( lod + 1.0 ) ) );
		vec2 fLodSizeInv = 1.0 / fLodSize;
		vec2 cLodSizeInv = 1.0 / cLodSize;
		vec4 fSample = bicubic( sampler, uv, vec4( fLodSizeInv, fLodSize ), floor( lod ) );
		vec4 cSample = bicubic( sampler, uv, vec4( cLodSizeInv, cLodSize ), ceil( lod ) );
		return mix( fSample, cSample, fract( lod ) );
	}
	vec3 getVolumeTransmissionRay( const in vec3 n, const in vec3 v, const in float thickness, const in float ior, const in mat4 modelMatrix ) {
		vec3 refractionVector = refract( - v, normalize( n ), 1.0 / ior );
		vec3 modelScale;
		modelScale.x = length( vec3( modelMatrix[ 0 ].xyz ) );
		modelScale.y = length( vec3( modelMatrix[ 1 ].xyz ) );
		modelScale.z = length( vec3( modelMatrix[ 2 ].xyz ) );
		return normalize( refractionVector ) * thickness * modelScale;
	}
	float applyIorToRoughness( const in float roughness, const in float ior ) {
		return roughness * clamp( ior * 2.0 - 2.0, 0.0, 1.0 );
	}
	vec4 getTransmissionSample( const in vec2 fragCoord, const in float roughness, const in float ior ) {
		float lod = log2( transmissionSamplerSize.x ) * applyIorToRoughness( roughness, ior );
		return textureBicubic( transmissionSamplerMap, fragCoord.xy, lod );
	}
	vec3 volumeAttenuation( const in float transmissionDistance, const in vec3 attenuationColor, const in float attenuationDistance ) {
		if ( isinf( attenuationDistance ) ) {
			return vec3( 1.0 );
		} else {
			vec3 attenuationCoefficient = -log( attenuationColor ) / attenuationDistance;
			vec3 transmittance = exp( - attenuationCoefficient * transmissionDistance );			return transmittance;
		}
	}
	vec4 getIBLVolumeRefraction( const in vec3 n, const in vec3 v, const in float roughness, const in vec3 diffuseColor,
		const in vec3 specularColor, const in float specularF90, const in vec3 position, const in mat4 modelMatrix,
		const in mat4 viewMatrix, const in mat4 projMatrix, const in float dispersion, const in float ior, const in float thickness,
		const in vec3 attenuationColor, const in float attenuationDistance ) {
		vec4 transmittedLight;
		vec3 transmittance;
		#ifdef USE_DISPERSION
			float halfSpread = ( ior - 1.0 ) * 0.025 * dispersion;
			vec3 iors = vec3( ior - halfSpread, ior, ior + halfSpread );
			for ( int i = 0; i < 3; i ++ ) {
				vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, iors[ i ], modelMatrix );
				vec3 refractedRayExit = position + transmissionRay;
				vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
				vec2 refractionCoords = ndcPos.xy / ndcPos.w;
				refractionCoords += 1.0;
				refractionCoords /= 2.0;
				vec4 transmissionSample = getTransmissionSample( refractionCoords, roughness, iors[ i ] );
				transmittedLight[ i ] = transmissionSample[ i ];
				transmittedLight.a += transmissionSample.a;
				transmittance[ i ] = diffuseColor[ i ] * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance )[ i ];
			}
			transmittedLight.a /= 3.0;
		#else
			vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, ior, modelMatrix );
			vec3 refractedRayExit = position + transmissionRay;
			vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
			vec2 refractionCoords = ndcPos.xy / ndcPos.w;
			refractionCoords += 1.0;
			refractionCoords /= 2.0;
			transmittedLight = getTransmissionSample( refractionCoords, roughness, ior );
			transmittance = diffuseColor * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance );
		#endif
		vec3 attenuatedColor = transmittance * transmittedLight.rgb;
		vec3 F = EnvironmentBRDF( n, v, specularColor, specularF90, roughness );
		float transmittanceFactor = ( transmittance.r + transmittance.g + transmittance.b ) / 3.0;
		return vec4( ( 1.0 - F ) * attenuatedColor, 1.0 - ( 1.0 - transmittedLight.a ) * transmittanceFactor );
	}
#endif`,qM=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,YM=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	uniform mat3 mapTransform;
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	uniform mat3 alphaMapTransform;
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	uniform mat3 lightMapTransform;
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	uniform mat3 aoMapTransform;
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	uniform mat3 bumpMapTransform;
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	uniform mat3 normalMapTransform;
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
	uniform mat3 displacementMapTransform;
	varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	uniform mat3 emissiveMapTransform;
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	uniform mat3 metalnessMapTransform;
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	uniform mat3 roughnessMapTransform;
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	uniform mat3 diffuseRoughnessMapTransform;
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	uniform mat3 anisotropyMapTransform;
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	uniform mat3 clearcoatMapTransform;
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform mat3 clearcoatNormalMapTransform;
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform mat3 clearcoatRoughnessMapTransform;
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	uniform mat3 sheenColorMapTransform;
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	uniform mat3 sheenRoughnessMapTransform;
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	uniform mat3 iridescenceMapTransform;
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform mat3 iridescenceThicknessMapTransform;
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
	uniform mat3 specularMapTransform;
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	uniform mat3 specularColorMapTransform;
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	uniform mat3 specularIntensityMapTransform;
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,$M=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	vUv = vec3( uv, 1 ).xy;
#endif
#ifdef USE_MAP
	vMapUv = ( mapTransform * vec3( MAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
	vAlphaMapUv = ( alphaMapTransform * vec3( ALPHAMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
	vLightMapUv = ( lightMapTransform * vec3( LIGHTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_AOMAP
	vAoMapUv = ( aoMapTransform * vec3( AOMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
	vBumpMapUv = ( bumpMapTransform * vec3( BUMPMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
	vNormalMapUv = ( normalMapTransform * vec3( NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
	vDisplacementMapUv = ( displacementMapTransform * vec3( DISPLACEMENTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
	vEmissiveMapUv = ( emissiveMapTransform * vec3( EMISSIVEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
	vMetalnessMapUv = ( metalnessMapTransform * vec3( METALNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
	vRoughnessMapUv = ( roughnessMapTransform * vec3( ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	vDiffuseRoughnessMapUv = ( diffuseRoughnessMapTransform * vec3( DIFFUSE_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
	vAnisotropyMapUv = ( anisotropyMapTransform * vec3( ANISOTROPYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
	vClearcoatMapUv = ( clearcoatMapTransform * vec3( CLEARCOATMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	vClearcoatNormalMapUv = ( clearcoatNormalMapTransform * vec3( CLEARCOAT_NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	vClearcoatRoughnessMapUv = ( clearcoatRoughnessMapTransform * vec3( CLEARCOAT_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
	vIridescenceMapUv = ( iridescenceMapTransform * vec3( IRIDESCENCEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	vIridescenceThicknessMapUv = ( iridescenceThicknessMapTransform * vec3( IRIDESCENCE_THICKNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
	vSheenColorMapUv = ( sheenColorMapTransform * vec3( SHEEN_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	vSheenRoughnessMapUv = ( sheenRoughnessMapTransform * vec3( SHEEN_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
	vSpecularMapUv = ( specularMapTransform * vec3( SPECULARMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
	vSpecularColorMapUv = ( specularColorMapTransform * vec3( SPECULAR_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	vSpecularIntensityMapUv = ( specularIntensityMapTransform * vec3( SPECULAR_INTENSITYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
	vTransmissionMapUv = ( transmissionMapTransform * vec3( TRANSMISSIONMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
	vThicknessMapUv = ( thicknessMapTransform * vec3( THICKNESSMAP_UV, 1 ) ).xy;
#endif`,ZM=`#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
	vec4 worldPosition = vec4( transformed, 1.0 );
	#ifdef USE_BATCHING
		worldPosition = batchingMatrix * worldPosition;
	#endif
	#ifdef USE_INSTANCING
		worldPosition = instanceMatrix * worldPosition;
	#endif
	worldPosition = modelMatrix * worldPosition;
#endif`,JM=`varying vec2 vUv;
uniform mat3 uvTransform;
void main() {
	vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	gl_Position = vec4( position.xy, 1.0, 1.0 );
}`,KM=`uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main() {
	vec4 texColor = texture2D( t2D, vUv );
	#ifdef DECODE_VIDEO_TEXTURE
		texColor = vec4( mix( pow( texColor.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), texColor.rgb * 0.0773993808, vec3( lessThanEqual( texColor.rgb, vec3( 0.04045 ) ) ) ), texColor.w );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,jM=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,QM=`uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main() {
	#ifdef ENVMAP_TYPE_PMREM
		vec4 texColor = textureLod( envMap, backgroundRotation * vWorldDirection, roughnessToMip( backgroundBlurriness ) );
	#else
		vec4 texColor = textureCube( envMap, backgroundRotation * vWorldDirection );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,ew=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,tw=`uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main() {
	vec4 texColor = textureCube( tCube, vec3( tFlip * vWorldDirection.x, vWorldDirection.yz ) );
	gl_FragColor = texColor;
	gl_FragColor.a *= opacity;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,nw=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vHighPrecisionZW = gl_Position.zw;
}`,iw=`#if DEPTH_PACKING == 3200
	uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#if DEPTH_PACKING == 3200
		diffuseColor.a = opacity;
	#endif
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <logdepthbuf_fragment>
	#ifdef USE_REVERSED_DEPTH_BUFFER
		float fragCoordZ = vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ];
	#else
		float fragCoordZ = 0.5 * vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ] + 0.5;
	#endif
	#if DEPTH_PACKING == 3200
		gl_FragColor = vec4( vec3( 1.0 - fragCoordZ ), opacity );
	#elif DEPTH_PACKING == 3201
		gl_FragColor = packDepthToRGBA( fragCoordZ );
	#elif DEPTH_PACKING == 3202
		gl_FragColor = vec4( packDepthToRGB( fragCoordZ ), 1.0 );
	#elif DEPTH_PACKING == 3203
		gl_FragColor = vec4( packDepthToRG( fragCoordZ ), 0.0, 1.0 );
	#endif
}`,sw=`#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <worldpos_vertex>
	#include <clipping_planes_vertex>
	vWorldPosition = worldPosition.xyz;
}`,rw=`#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	float dist = length( vWorldPosition - referencePosition );
	dist = ( dist - nearDistance ) / ( farDistance - nearDistance );
	dist = saturate( dist );
	gl_FragColor = vec4( dist, 0.0, 0.0, 1.0 );
}`,ow=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
}`,aw=`uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main() {
	vec3 direction = normalize( vWorldDirection );
	vec2 sampleUV = equirectUv( direction );
	gl_FragColor = texture2D( tEquirect, sampleUV );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,lw=`uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	vLineDistance = scale * lineDistance;
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,cw=`uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	if ( mod( vLineDistance, totalSize ) > dashSize ) {
		discard;
	}
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,uw=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinbase_vertex>
		#include <skinnormal_vertex>
		#include <defaultnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <fog_vertex>
}`,hw=`uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
	varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		reflectedLight.indirectDiffuse += lightMapTexel.rgb * lightMapIntensity * RECIPROCAL_PI;
	#else
		reflectedLight.indirectDiffuse += vec3( 1.0 );
	#endif
	#include <aomap_fragment>
	reflectedLight.indirectDiffuse *= diffuseColor.rgb;
	vec3 outgoingLight = reflectedLight.indirectDiffuse;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,dw=`#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,fw=`#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_lambert_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,pw=`#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
	vViewPosition = - mvPosition.xyz;
}`,mw=`#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	vec3 viewDir = normalize( vViewPosition );
	vec3 x = normalize( vec3( viewDir.z, 0.0, - viewDir.x ) );
	vec3 y = cross( viewDir, x );
	vec2 uv = vec2( dot( x, normal ), dot( y, normal ) ) * 0.495 + 0.5;
	#ifdef USE_MATCAP
		vec4 matcapColor = texture2D( matcap, uv );
	#else
		vec4 matcapColor = vec4( vec3( mix( 0.2, 0.8, uv.y ) ), 1.0 );
	#endif
	vec3 outgoingLight = diffuseColor.rgb * matcapColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,gw=`#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	vViewPosition = - mvPosition.xyz;
#endif
}`,_w=`#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 0.0, 0.0, 0.0, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	gl_FragColor = vec4( normalize( normal ) * 0.5 + 0.5, diffuseColor.a );
	#ifdef OPAQUE
		gl_FragColor.a = 1.0;
	#endif
}`,vw=`#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,xw=`#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_phong_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + reflectedLight.directSpecular + reflectedLight.indirectSpecular + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,yw=`#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
	varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
#ifdef USE_TRANSMISSION
	vWorldPosition = worldPosition.xyz;
#endif
}`,bw=`#define STANDARD
#ifdef PHYSICAL
	#define IOR
	#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
	uniform float ior;
#endif
#ifdef USE_SPECULAR
	uniform float specularIntensity;
	uniform vec3 specularColor;
	#ifdef USE_SPECULAR_COLORMAP
		uniform sampler2D specularColorMap;
	#endif
	#ifdef USE_SPECULAR_INTENSITYMAP
		uniform sampler2D specularIntensityMap;
	#endif
#endif
#ifdef USE_CLEARCOAT
	uniform float clearcoat;
	uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
	uniform float diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		uniform sampler2D diffuseRoughnessMap;
	#endif
#endif
#ifdef USE_DISPERSION
	uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
	uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	uniform float iridescence;
	uniform float iridescenceIOR;
	uniform float iridescenceThicknessMinimum;
	uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
	uniform vec3 sheenColor;
	uniform float sheenRoughness;
	#ifdef USE_SHEEN_COLORMAP
		uniform sampler2D sheenColorMap;
	#endif
	#ifdef USE_SHEEN_ROUGHNESSMAP
		uniform sampler2D sheenRoughnessMap;
	#endif
#endif
#ifdef USE_ANISOTROPY
	uniform vec2 anisotropyVector;
	#ifdef USE_ANISOTROPYMAP
		uniform sampler2D anisotropyMap;
	#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <roughnessmap_fragment>
	#include <metalnessmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <clearcoat_normal_fragment_begin>
	#include <clearcoat_normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_physical_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 totalDiffuse = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse;
	vec3 totalSpecular = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
	#include <transmission_fragment>
	vec3 outgoingLight = totalDiffuse + totalSpecular + totalEmissiveRadiance;
	#ifdef USE_SHEEN
 
		outgoingLight = outgoingLight + sheenSpecularDirect + sheenSpecularIndirect;
 
 	#endif
	#ifdef USE_CLEARCOAT
		float dotNVcc = saturate( dot( geometryClearcoatNormal, geometryViewDir ) );
		vec3 Fcc = F_Schlick( material.clearcoatF0, material.clearcoatF90, dotNVcc );
		outgoingLight = outgoingLight * ( 1.0 - material.clearcoat * Fcc ) + ( clearcoatSpecularDirect + clearcoatSpecularIndirect ) * material.clearcoat;
	#endif
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,Sw=`#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,Mw=`#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_toon_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,ww=`uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
	varying vec2 vUv;
	uniform mat3 uvTransform;
#endif
void main() {
	#ifdef USE_POINTS_UV
		vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	#endif
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	gl_PointSize = size;
	#ifdef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) gl_PointSize *= ( scale / - mvPosition.z );
	#endif
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <fog_vertex>
}`,Tw=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_particle_fragment>
	#include <color_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,Ew=`#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main() {
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,Aw=`uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main() {
	#include <logdepthbuf_fragment>
	gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,Cw=`uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	vec4 mvPosition = modelViewMatrix[ 3 ];
	vec2 scale = vec2( length( modelMatrix[ 0 ].xyz ), length( modelMatrix[ 1 ].xyz ) );
	#ifndef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) scale *= - mvPosition.z;
	#endif
	vec2 alignedPosition = ( position.xy - ( center - vec2( 0.5 ) ) ) * scale;
	vec2 rotatedPosition;
	rotatedPosition.x = cos( rotation ) * alignedPosition.x - sin( rotation ) * alignedPosition.y;
	rotatedPosition.y = sin( rotation ) * alignedPosition.x + cos( rotation ) * alignedPosition.y;
	mvPosition.xy += rotatedPosition;
	gl_Position = projectionMatrix * mvPosition;
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,Rw=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
}`,mt={alphahash_fragment:Kb,alphahash_pars_fragment:jb,alphamap_fragment:Qb,alphamap_pars_fragment:eS,alphatest_fragment:tS,alphatest_pars_fragment:nS,aomap_fragment:iS,aomap_pars_fragment:sS,batching_pars_vertex:rS,batching_vertex:oS,begin_vertex:aS,beginnormal_vertex:lS,bsdfs:cS,iridescence_fragment:uS,bumpmap_pars_fragment:hS,clipping_planes_fragment:dS,clipping_planes_pars_fragment:fS,clipping_planes_pars_vertex:pS,clipping_planes_vertex:mS,color_fragment:gS,color_pars_fragment:_S,color_pars_vertex:vS,color_vertex:xS,common:yS,defaultnormal_vertex:bS,displacementmap_pars_vertex:SS,displacementmap_vertex:MS,emissivemap_fragment:wS,emissivemap_pars_fragment:TS,colorspace_fragment:ES,colorspace_pars_fragment:AS,envmap_fragment:CS,envmap_common_pars_fragment:RS,envmap_pars_fragment:PS,envmap_pars_vertex:IS,envmap_physical_pars_fragment:GS,envmap_vertex:LS,fog_vertex:DS,fog_pars_vertex:NS,fog_fragment:US,fog_pars_fragment:OS,gradientmap_pars_fragment:FS,lightmap_pars_fragment:kS,lights_lambert_fragment:BS,lights_lambert_pars_fragment:zS,lights_pars_begin:VS,lights_toon_fragment:HS,lights_toon_pars_fragment:WS,lights_phong_fragment:XS,lights_phong_pars_fragment:qS,lights_physical_fragment:YS,lights_physical_pars_fragment:$S,lights_fragment_begin:ZS,lights_fragment_maps:JS,lights_fragment_end:KS,lightprobes_pars_fragment:jS,logdepthbuf_fragment:QS,logdepthbuf_pars_fragment:eM,logdepthbuf_pars_vertex:tM,logdepthbuf_vertex:nM,map_fragment:iM,map_pars_fragment:sM,map_particle_fragment:rM,map_particle_pars_fragment:oM,metalnessmap_fragment:aM,metalnessmap_pars_fragment:lM,morphinstance_vertex:cM,morphcolor_vertex:uM,morphnormal_vertex:hM,morphtarget_pars_vertex:dM,morphtarget_vertex:fM,normal_fragment_begin:pM,normal_fragment_maps:mM,normal_pars_fragment:gM,normal_pars_vertex:_M,normal_vertex:vM,normalmap_pars_fragment:xM,clearcoat_normal_fragment_begin:yM,clearcoat_normal_fragment_maps:bM,clearcoat_pars_fragment:SM,iridescence_pars_fragment:MM,opaque_fragment:wM,packing:TM,premultiplied_alpha_fragment:EM,project_vertex:AM,dithering_fragment:CM,dithering_pars_fragment:RM,roughnessmap_fragment:PM,roughnessmap_pars_fragment:IM,shadowmap_pars_fragment:LM,shadowmap_pars_vertex:DM,shadowmap_vertex:NM,shadowmask_pars_fragment:UM,skinbase_vertex:OM,skinning_pars_vertex:FM,skinning_vertex:kM,skinnormal_vertex:BM,specularmap_fragment:zM,specularmap_pars_fragment:VM,tonemapping_fragment:GM,tonemapping_pars_fragment:HM,transmission_fragment:WM,transmission_pars_fragment:XM,uv_pars_fragment:qM,uv_pars_vertex:YM,uv_vertex:$M,worldpos_vertex:ZM,background_vert:JM,background_frag:KM,backgroundCube_vert:jM,backgroundCube_frag:QM,cube_vert:ew,cube_frag:tw,depth_vert:nw,depth_frag:iw,distance_vert:sw,distance_frag:rw,equirect_vert:ow,equirect_frag:aw,linedashed_vert:lw,linedashed_frag:cw,meshbasic_vert:uw,meshbasic_frag:hw,meshlambert_vert:dw,meshlambert_frag:fw,meshmatcap_vert:pw,meshmatcap_frag:mw,meshnormal_vert:gw,meshnormal_frag:_w,meshphong_vert:vw,meshphong_frag:xw,meshphysical_vert:yw,meshphysical_frag:bw,meshtoon_vert:Sw,meshtoon_frag:Mw,points_vert:ww,points_frag:Tw,shadow_vert:Ew,shadow_frag:Aw,sprite_vert:Cw,sprite_frag:Rw},Le={common:{diffuse:{value:new it(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new st},alphaMap:{value:null},alphaMapTransform:{value:new st},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new st}},envmap:{envMap:{value:null},envMapRotation:{value:new st},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new st}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new st}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new st},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new st},normalScale:{value:new Xe(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new st},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new st}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new st}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new st}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new it(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new it(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new st},alphaTest:{value:0},uvTransform:{value:new st}},sprite:{diffuse:{value:new it(16777215)},opacity:{value:1},center:{value:new Xe(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new st},alphaMap:{value:null},alphaMapTransform:{value:new st},alphaTest:{value:0}}},mi={basic:{uniforms:ni([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.fog]),vertexShader:mt.meshbasic_vert,fragmentShader:mt.meshbasic_frag},lambert:{uniforms:ni([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,Le.lights,{emissive:{value:new it(0)},envMapIntensity:{value:1}}]),vertexShader:mt.meshlambert_vert,fragmentShader:mt.meshlambert_frag},phong:{uniforms:ni([Le.common,Le.specularmap,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,Le.lights,{emissive:{value:new it(0)},specular:{value:new it(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:mt.meshphong_vert,fragmentShader:mt.meshphong_frag},standard:{uniforms:ni([Le.common,Le.envmap,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.roughnessmap,Le.metalnessmap,Le.fog,Le.lights,{emissive:{value:new it(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:mt.meshphysical_vert,fragmentShader:mt.meshphysical_frag},toon:{uniforms:ni([Le.common,Le.aomap,Le.lightmap,Le.emissivemap,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.gradientmap,Le.fog,Le.lights,{emissive:{value:new it(0)}}]),vertexShader:mt.meshtoon_vert,fragmentShader:mt.meshtoon_frag},matcap:{uniforms:ni([Le.common,Le.bumpmap,Le.normalmap,Le.displacementmap,Le.fog,{matcap:{value:null}}]),vertexShader:mt.meshmatcap_vert,fragmentShader:mt.meshmatcap_frag},points:{uniforms:ni([Le.points,Le.fog]),vertexShader:mt.points_vert,fragmentShader:mt.points_frag},dashed:{uniforms:ni([Le.common,Le.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:mt.linedashed_vert,fragmentShader:mt.linedashed_frag},depth:{uniforms:ni([Le.common,Le.displacementmap]),vertexShader:mt.depth_vert,fragmentShader:mt.depth_frag},normal:{uniforms:ni([Le.common,Le.bumpmap,Le.normalmap,Le.displacementmap,{opacity:{value:1}}]),vertexShader:mt.meshnormal_vert,fragmentShader:mt.meshnormal_frag},sprite:{uniforms:ni([Le.sprite,Le.fog]),vertexShader:mt.sprite_vert,fragmentShader:mt.sprite_frag},background:{uniforms:{uvTransform:{value:new st},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:mt.background_vert,fragmentShader:mt.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new st}},vertexShader:mt.backgroundCube_vert,fragmentShader:mt.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:mt.cube_vert,fragmentShader:mt.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:mt.equirect_vert,fragmentShader:mt.equirect_frag},distance:{uniforms:ni([Le.common,Le.displacementmap,{referencePosition:{value:new O},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:mt.distance_vert,fragmentShader:mt.distance_frag},shadow:{uniforms:ni([Le.lights,Le.fog,{color:{value:new it(0)},opacity:{value:1}}]),vertexShader:mt.shadow_vert,fragmentShader:mt.shadow_frag}};mi.physical={uniforms:ni([mi.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new st},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new st},clearcoatNormalScale:{value:new Xe(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new st},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new st},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new st},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new st},sheen:{value:0},sheenColor:{value:new it(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new st},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new st},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new st},transmissionSamplerSize:{value:new Xe},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new st},attenuationDistance:{value:0},attenuationColor:{value:new it(0)},specularColor:{value:new it(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new st},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new st},anisotropyVector:{value:new Xe},anisotropyMap:{value:null},anisotropyMapTransform:{value:new st}}]),vertexShader:mt.meshphysical_vert,fragmentShader:mt.meshphysical_frag};var ch={r:0,b:0,g:0},Pw=new Et,p0=new st;p0.set(-1,0,0,0,1,0,0,0,1);function Iw(n,e,t,i,s,r){let o=new it(0),a=s===!0?0:1,l,c,u=null,f=0,d=null;function p(x){let T=x.isScene===!0?x.background:null;if(T&&T.isTexture){let S=x.backgroundBlurriness>0;T=e.get(T,S)}return T}function g(x){let T=!1,S=p(x);S===null?m(o,a):S&&S.isColor&&(m(S,1),T=!0);let R=n.xr.getEnvironmentBlendMode();R==="additive"?t.buffers.color.setClear(0,0,0,1,r):R==="alpha-blend"&&t.buffers.color.setClear(0,0,0,0,r),(n.autoClear||T)&&(t.buffers.depth.setTest(!0),t.buffers.depth.setMask(!0),t.buffers.color.setMask(!0),n.clear(n.autoClearColor,n.autoClearDepth,n.autoClearStencil))}function v(x,T){let S=p(T);S&&S.isCubeTexture?(c===void 0&&(c=new Ne(new tn(1,1,1),new Gi({name:"BackgroundCubeMaterial",uniforms:Xr(mi.backgroundCube.uniforms),vertexShader:mi.backgroundCube.vertexShader,fragmentShader:mi.backgroundCube.fragmentShader,side:pi,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),c.geometry.deleteAttribute("uv"),c.onBeforeRender=function(R,C,y){this.matrixWorld.copyPosition(y.matrixWorld)},Object.defineProperty(c.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),i.update(c)),c.material.uniforms.envMap.value=S,c.material.uniforms.backgroundBlurriness.value=T.backgroundBlurriness,c.material.uniforms.backgroundIntensity.value=T.backgroundIntensity,c.material.uniforms.backgroundRotation.value.setFromMatrix4(Pw.makeRotationFromEuler(T.backgroundRotation)).transpose(),S.isRenderTargetTexture===!1&&c.material.uniforms.backgroundRotation.value.premultiply(p0),c.material.toneMapped=St.getTransfer(S.colorSpace)!==Dt,(u!==S||f!==S.version||d!==n.toneMapping)&&(c.material.needsUpdate=!0,u=S,f=S.version,d=n.toneMapping),c.layers.enableAll(),x.unshift(c,c.geometry,c.material,0,0,null)):S&&S.isTexture&&(l===void 0&&(l=new Ne(new kr(2,2),new Gi({name:"BackgroundMaterial",uniforms:Xr(mi.background.uniforms),vertexShader:mi.background.vertexShader,fragmentShader:mi.background.fragmentShader,side:xr,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),Object.defineProperty(l.material,"map",{get:function(){return this.uniforms.t2D.value}}),i.update(l)),l.material.uniforms.t2D.value=S,l.material.uniforms.backgroundIntensity.value=T.backgroundIntensity,l.material.toneMapped=St.getTransfer(S.colorSpace)!==Dt,S.matrixAutoUpdate===!0&&S.updateMatrix(),l.material.uniforms.uvTransform.value.copy(S.matrix),(u!==S||f!==S.version||d!==n.toneMapping)&&(l.material.needsUpdate=!0,u=S,f=S.version,d=n.toneMapping),l.layers.enableAll(),x.unshift(l,l.geometry,l.material,0,0,null))}function m(x,T){x.getRGB(ch,jf(n)),t.buffers.color.setClear(ch.r,ch.g,ch.b,T,r)}function _(){c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0),l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0)}return{getClearColor:function(){return o},setClearColor:function(x,T=1){o.set(x),a=T,m(o,a)},getClearAlpha:function(){return a},setClearAlpha:function(x){a=x,m(o,a)},render:g,addToRenderList:v,dispose:_}}function Lw(n,e){let t=n.getParameter(n.MAX_VERTEX_ATTRIBS),i={},s=d(null),r=s,o=!1;function a(D,z,G,U,W){let $=!1,H=f(D,U,G,z);r!==H&&(r=H,c(r.object)),$=p(D,U,G,W),$&&g(D,U,G,W),W!==null&&e.update(W,n.ELEMENT_ARRAY_BUFFER),($||o)&&(o=!1,S(D,z,G,U),W!==null&&n.bindBuffer(n.ELEMENT_ARRAY_BUFFER,e.get(W).buffer))}function l(){return n.createVertexArray()}function c(D){return n.bindVertexArray(D)}function u(D){return n.deleteVertexArray(D)}function f(D,z,G,U){let W=U.wireframe===!0,$=i[z.id];$===void 0&&($={},i[z.id]=$);let H=D.isInstancedMesh===!0?D.id:0,le=$[H];le===void 0&&(le={},$[H]=le);let Y=le[G.id];Y===void 0&&(Y={},le[G.id]=Y);let Q=Y[W];return Q===void 0&&(Q=d(l()),Y[W]=Q),Q}function d(D){let z=[],G=[],U=[];for(let W=0;W<t;W++)z[W]=0,G[W]=0,U[W]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:z,enabledAttributes:G,attributeDivisors:U,object:D,attributes:{},index:null}}function p(D,z,G,U){let W=r.attributes,$=z.attributes,H=0,le=G.getAttributes();for(let Y in le)if(le[Y].location>=0){let ie=W[Y],he=$[Y];if(he===void 0&&(Y==="instanceMatrix"&&D.instanceMatrix&&(he=D.instanceMatrix),Y==="instanceColor"&&D.instanceColor&&(he=D.instanceColor)),ie===void 0||ie.attribute!==he||he&&ie.data!==he.data)return!0;H++}return r.attributesNum!==H||r.index!==U}function g(D,z,G,U){let W={},$=z.attributes,H=0,le=G.getAttributes();for(let Y in le)if(le[Y].location>=0){let ie=$[Y];ie===void 0&&(Y==="instanceMatrix"&&D.instanceMatrix&&(ie=D.instanceMatrix),Y==="instanceColor"&&D.instanceColor&&(ie=D.instanceColor));let he={};he.attribute=ie,ie&&ie.data&&(he.data=ie.data),W[Y]=he,H++}r.attributes=W,r.attributesNum=H,r.index=U}function v(){let D=r.newAttributes;for(let z=0,G=D.length;z<G;z++)D[z]=0}function m(D){_(D,0)}function _(D,z){let G=r.newAttributes,U=r.enabledAttributes,W=r.attributeDivisors;G[D]=1,U[D]===0&&(n.enableVertexAttribArray(D),U[D]=1),W[D]!==z&&(n.vertexAttribDivisor(D,z),W[D]=z)}function x(){let D=r.newAttributes,z=r.enabledAttributes;for(let G=0,U=z.length;G<U;G++)z[G]!==D[G]&&(n.disableVertexAttribArray(G),z[G]=0)}function T(D,z,G,U,W,$,H){H===!0?n.vertexAttribIPointer(D,z,G,W,$):n.vertexAttribPointer(D,z,G,U,W,$)}function S(D,z,G,U){v();let W=U.attributes,$=G.getAttributes(),H=z.defaultAttributeValues;for(let le in $){let Y=$[le];if(Y.location>=0){let Q=W[le];if(Q===void 0&&(le==="instanceMatrix"&&D.instanceMatrix&&(Q=D.instanceMatrix),le==="instanceColor"&&D.instanceColor&&(Q=D.instanceColor)),Q!==void 0){let ie=Q.normalized,he=Q.itemSize,de=e.get(Q);if(de===void 0)continue;let ee=de.buffer,ge=de.type,xe=de.bytesPerElement,Re=ge===n.INT||ge===n.UNSIGNED_INT||Q.gpuType===Tu;if(Q.isInterleavedBufferAttribute){let Me=Q.data,Ye=Me.isInterleavedBuffer===!0?Me.stride:Me.itemSize,lt=Q.offset;if(Me.isInstancedInterleavedBuffer||Me.isInstancedBufferAttribute){for(let We=0;We<Y.locationSize;We++)_(Y.location+We,Me.meshPerAttribute);D.isInstancedMesh!==!0&&U._maxInstanceCount===void 0&&(U._maxInstanceCount=Me.meshPerAttribute*Me.count)}else for(let We=0;We<Y.locationSize;We++)m(Y.location+We);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let We=0;We<Y.locationSize;We++)T(Y.location+We,he/Y.locationSize,ge,ie,Ye*xe,(lt+he/Y.locationSize*We)*xe,Re)}else{if(Q.isInstancedBufferAttribute){for(let Me=0;Me<Y.locationSize;Me++)_(Y.location+Me,Q.meshPerAttribute);D.isInstancedMesh!==!0&&U._maxInstanceCount===void 0&&(U._maxInstanceCount=Q.meshPerAttribute*Q.count)}else for(let Me=0;Me<Y.locationSize;Me++)m(Y.location+Me);n.bindBuffer(n.ARRAY_BUFFER,ee);for(let Me=0;Me<Y.locationSize;Me++)T(Y.location+Me,he/Y.locationSize,ge,ie,he*xe,he/Y.locationSize*Me*xe,Re)}}else if(H!==void 0){let ie=H[le];if(ie!==void 0)switch(ie.length){case 2:n.vertexAttrib2fv(Y.location,ie);break;case 3:n.vertexAttrib3fv(Y.location,ie);break;case 4:n.vertexAttrib4fv(Y.location,ie);break;default:n.vertexAttrib1fv(Y.location,ie)}}}}x()}function R(){N();for(let D in i){let z=i[D];for(let G in z){let U=z[G];for(let W in U){let $=U[W];for(let H in $)u($[H].object),delete $[H];delete U[W]}}delete i[D]}}function C(D){if(i[D.id]===void 0)return;let z=i[D.id];for(let G in z){let U=z[G];for(let W in U){let $=U[W];for(let H in $)u($[H].object),delete $[H];delete U[W]}}delete i[D.id]}function y(D){for(let z in i){let G=i[z];for(let U in G){let W=G[U];if(W[D.id]===void 0)continue;let $=W[D.id];for(let H in $)u($[H].object),delete $[H];delete W[D.id]}}}function M(D){for(let z in i){let G=i[z],U=D.isInstancedMesh===!0?D.id:0,W=G[U];if(W!==void 0){for(let $ in W){let H=W[$];for(let le in H)u(H[le].object),delete H[le];delete W[$]}delete G[U],Object.keys(G).length===0&&delete i[z]}}}function N(){P(),o=!0,r!==s&&(r=s,c(r.object))}function P(){s.geometry=null,s.program=null,s.wireframe=!1}return{setup:a,reset:N,resetDefaultState:P,dispose:R,releaseStatesOfGeometry:C,releaseStatesOfObject:M,releaseStatesOfProgram:y,initAttributes:v,enableAttribute:m,disableUnusedAttributes:x}}function Dw(n,e,t){let i;function s(l){i=l}function r(l,c){n.drawArrays(i,l,c),t.update(c,i,1)}function o(l,c,u){u!==0&&(n.drawArraysInstanced(i,l,c,u),t.update(c,i,u))}function a(l,c,u){if(u===0)return;e.get("WEBGL_multi_draw").multiDrawArraysWEBGL(i,l,0,c,0,u);let d=0;for(let p=0;p<u;p++)d+=c[p];t.update(d,i,1)}this.setMode=s,this.render=r,this.renderInstances=o,this.renderMultiDraw=a}function Nw(n,e,t,i){let s;function r(){if(s!==void 0)return s;if(e.has("EXT_texture_filter_anisotropic")===!0){let y=e.get("EXT_texture_filter_anisotropic");s=n.getParameter(y.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else s=0;return s}function o(y){return!(y!==as&&i.convert(y)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(y){let M=y===os&&(e.has("EXT_color_buffer_half_float")||e.has("EXT_color_buffer_float"));return!(y!==yi&&y!==rs&&!M&&i.convert(y)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_TYPE))}function l(y){if(y==="highp"){if(n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.HIGH_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.HIGH_FLOAT).precision>0)return"highp";y="mediump"}return y==="mediump"&&n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.MEDIUM_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let c=t.precision!==void 0?t.precision:"highp",u=l(c);u!==c&&(Je("WebGLRenderer:",c,"not supported, using",u,"instead."),c=u);let f=t.reversedDepthBuffer===!0&&e.has("EXT_clip_control"),d=t.logarithmicDepthBuffer===!0&&f===!1;t.reversedDepthBuffer===!0&&f===!1&&Je("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),t.logarithmicDepthBuffer===!0&&f===!0&&Je("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");let p=n.getParameter(n.MAX_TEXTURE_IMAGE_UNITS),g=n.getParameter(n.MAX_VERTEX_TEXTURE_IMAGE_UNITS),v=n.getParameter(n.MAX_TEXTURE_SIZE),m=n.getParameter(n.MAX_CUBE_MAP_TEXTURE_SIZE),_=n.getParameter(n.MAX_VERTEX_ATTRIBS),x=n.getParameter(n.MAX_VERTEX_UNIFORM_VECTORS),T=n.getParameter(n.MAX_VARYING_VECTORS),S=n.getParameter(n.MAX_FRAGMENT_UNIFORM_VECTORS),R=n.getParameter(n.MAX_SAMPLES),C=n.getParameter(n.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:r,getMaxPrecision:l,textureFormatReadable:o,textureTypeReadable:a,precision:c,logarithmicDepthBuffer:d,reversedDepthBuffer:f,maxTextures:p,maxVertexTextures:g,maxTextureSize:v,maxCubemapSize:m,maxAttributes:_,maxVertexUniforms:x,maxVaryings:T,maxFragmentUniforms:S,maxSamples:R,samples:C}}function Uw(n){let e=this,t=null,i=0,s=!1,r=!1,o=new Ci,a=new st,l={value:null,needsUpdate:!1};this.uniform=l,this.numPlanes=0,this.numIntersection=0,this.init=function(f,d){let p=f.length!==0||d||i!==0||s;return s=d,i=f.length,p},this.beginShadows=function(){r=!0,u(null)},this.endShadows=function(){r=!1},this.setGlobalState=function(f,d){t=u(f,d,0)},this.setState=function(f,d,p){let g=f.clippingPlanes,v=f.clipIntersection,m=f.clipShadows,_=n.get(f);if(!s||g===null||g.length===0||r&&!m)r?u(null):c();else{let x=r?0:i,T=x*4,S=_.clippingState||null;l.value=S,S=u(g,d,T,p);for(let R=0;R!==T;++R)S[R]=t[R];_.clippingState=S,this.numIntersection=v?this.numPlanes:0,this.numPlanes+=x}};function c(){l.value!==t&&(l.value=t,l.needsUpdate=i>0),e.numPlanes=i,e.numIntersection=0}function u(f,d,p,g){let v=f!==null?f.length:0,m=null;if(v!==0){if(m=l.value,g!==!0||m===null){let _=p+v*4,x=d.matrixWorldInverse;a.getNormalMatrix(x),(m===null||m.length<_)&&(m=new Float32Array(_));for(let T=0,S=p;T!==v;++T,S+=4)o.copy(f[T]).applyMatrix4(x,a),o.normal.toArray(m,S),m[S+3]=o.constant}l.value=m,l.needsUpdate=!0}return e.numPlanes=v,e.numIntersection=0,m}}var Cl=class extends Pi{constructor(e=1,t={}){super(e,e,t),this.isWebGLCubeRenderTarget=!0;let i={width:e,height:e,depth:1},s=[i,i,i,i,i,i];this.texture=new tl(s),this._setTextureOptions(t),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(e,t){this.texture.type=t.type,this.texture.colorSpace=t.colorSpace,this.texture.generateMipmaps=t.generateMipmaps,this.texture.minFilter=t.minFilter,this.texture.magFilter=t.magFilter;let i={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},s=new tn(5,5,5),r=new Gi({name:"CubemapFromEquirect",uniforms:Xr(i.uniforms),vertexShader:i.vertexShader,fragmentShader:i.fragmentShader,side:pi,blending:Vr});r.uniforms.tEquirect.value=t;let o=new Ne(s,r),a=t.minFilter;return t.minFilter===Xs&&(t.minFilter=di),new Yo(1,10,this).update(e,o),t.minFilter=a,o.geometry.dispose(),o.material.dispose(),this}clear(e,t=!0,i=!0,s=!0){let r=e.getRenderTarget();for(let o=0;o<6;o++)e.setRenderTarget(this,o),e.clear(t,i,s);e.setRenderTarget(r)}},q_=256,Ow=3,Fw=20,m0=256,g0=16,kw=3,Bw=new O,zw=new it,hh=class n{constructor(e){this._renderer=e,this._cubeSize=0,this._sourceTarget=null,this._cubeCamera=new Yo(1,10,null),this._boxMesh=new Ne(new tn(5,5,5),null),this._cubemapMaterial=null,this._equirectMaterial=null,this._blurMaterial=null,this._ggxMaterial=null,this._integrationMaterial=null}fromScene(e,t=0,i=.1,s=100,r={}){let{size:o=256,position:a=Bw}=r,l=this._renderer;this._setSize(o);let c=this._allocateTarget(),u=this._getSourceTarget(!0);t>0&&(u.texture.mipmapsAutoUpdate=!1);let f=l.autoClear,d=l.autoClearColor,p=l.autoClearDepth,g=l.autoClearStencil,v=e.background;l.autoClear=!0,l.autoClearColor=!0,l.autoClearDepth=!0,l.autoClearStencil=!0,v===null&&(e.background=l.getClearColor(zw));let m=new Yo(i,s,u);return m.position.copy(a),m.update(l,e),l.autoClear=f,l.autoClearColor=d,l.autoClearDepth=p,l.autoClearStencil=g,e.background=v,t>0&&(u.texture.mipmapsAutoUpdate=!0,this._blur(c,t)),this._applyPMREM(c),c}fromEquirectangular(e,t=null){return this._fromTexture(e,t)}fromCubemap(e,t=null){return this._fromTexture(e,t)}compileCubemapShader(){this._cubemapMaterial===null&&(this._cubemapMaterial=Z_(),this._compileMaterial(this._cubemapMaterial))}compileEquirectangularShader(){this._equirectMaterial===null&&(this._equirectMaterial=$_(),this._compileMaterial(this._equirectMaterial))}dispose(){this._sourceTarget!==null&&this._sourceTarget.dispose(),this._cubemapMaterial!==null&&this._cubemapMaterial.dispose(),this._equirectMaterial!==null&&this._equirectMaterial.dispose(),this._blurMaterial!==null&&this._blurMaterial.dispose(),this._ggxMaterial!==null&&this._ggxMaterial.dispose(),this._integrationMaterial!==null&&this._integrationMaterial.dispose(),this._boxMesh.geometry.dispose()}static lodToRoughness(e,t){return t>0?1-Math.sqrt(1-e/t):0}_setSize(e){this._cubeSize=Math.max(q_,Zf(e))}_fromTexture(e,t){e.mapping===Hr||e.mapping===jo?this._setSize(e.image.length===0?q_:e.image[0].width||e.image[0].image.width):this._setSize(e.image.width/4);let i=t||this._allocateTarget();return this._textureToCubemap(e),this._applyPMREM(i),i}_allocateTarget(){let e=this._cubeSize,t=Y_(e,!1,!1),i=Math.log2(e)-Ow;for(let s=0;s<=i;s++)t.texture.mipmaps.push({width:e>>s,height:e>>s});return t.texture.name="PMREM",t.texture.isPMREMTexture=!0,t}_getSourceTarget(e=!1){let t=this._cubeSize,i=this._sourceTarget;return(i===null||i.width!==t||e&&i.depthBuffer===!1)&&(i!==null&&i.dispose(),this._sourceTarget=Y_(t,!0,e)),this._sourceTarget}_compileMaterial(e){this._boxMesh.material=e,this._renderer.compile(this._boxMesh,this._cubeCamera.children[0])}_renderCube(e,t,i){let s=this._boxMesh,r=this._cubeCamera;s.material=i,r.renderTarget=e,r.activeMipmapLevel=t;let o=e.width>>t;e.viewport.set(0,0,o,o),r.update(this._renderer,s),e.viewport.set(0,0,e.width,e.height)}_textureToCubemap(e){let t;e.mapping===Hr||e.mapping===jo?(this._cubemapMaterial===null&&(this._cubemapMaterial=Z_()),t=this._cubemapMaterial,t.uniforms.flipEnvMap.value=e.isRenderTargetTexture===!1?-1:1):(this._equirectMaterial===null&&(this._equirectMaterial=$_()),t=this._equirectMaterial),t.uniforms.envMap.value=e,this._renderCube(this._getSourceTarget(),0,t)}_applyPMREM(e){this._ggxMaterial===null&&(this._ggxMaterial=Vw(),this._integrationMaterial=Gw());let t=this._cubeSize,i=e.texture.mipmaps.length-1,s=this._ggxMaterial.uniforms;s.envMap.value=this._sourceTarget.texture;let r=this._integrationMaterial.uniforms;r.envMap.value=this._sourceTarget.texture,r.sourceLod.value=Math.log2(t/g0);for(let o=0;o<=i;o++){let a=n.lodToRoughness(o,i);if(o>i-kw)r.roughness.value=a,this._renderCube(e,o,this._integrationMaterial);else{let l=a>0?Math.log2(t)+.5*Math.log2(6/(m0*Math.pow(a,4)))+.5:0;s.roughness.value=a,s.lodBias.value=l,this._renderCube(e,o,this._ggxMaterial)}}}_blur(e,t){this._blurMaterial===null&&(this._blurMaterial=Hw());let i=this._blurMaterial,s=i.uniforms,r=this._sourceTarget;s.sigma.value=Math.min(t,Math.PI)/Math.SQRT2,s.envMap.value=r.texture,this._renderCube(e,0,i),s.envMap.value=e.texture,this._renderCube(r,0,i)}};function Y_(n,e,t){return new Cl(n,{minFilter:Xs,generateMipmaps:e,type:os,colorSpace:Ha,depthBuffer:t})}function Rl(n,e,t){return new Gi({name:n,uniforms:e,vertexShader:mt.cube_vert,fragmentShader:t,side:pi,blending:Vr,depthTest:!1,depthWrite:!1})}function Vw(){return Rl("PMREMGGXConvolution",{envMap:{value:null},roughness:{value:0},lodBias:{value:0}},`

		#define GGX_SAMPLES ${m0}u

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float lodBias;

		#include <common>

		// Van der Corput radical inverse
		float radicalInverse_VdC( uint bits ) {

			bits = ( bits << 16u ) | ( bits >> 16u );
			bits = ( ( bits & 0x55555555u ) << 1u ) | ( ( bits & 0xAAAAAAAAu ) >> 1u );
			bits = ( ( bits & 0x33333333u ) << 2u ) | ( ( bits & 0xCCCCCCCCu ) >> 2u );
			bits = ( ( bits & 0x0F0F0F0Fu ) << 4u ) | ( ( bits & 0xF0F0F0F0u ) >> 4u );
			bits = ( ( bits & 0x00FF00FFu ) << 8u ) | ( ( bits & 0xFF00FF00u ) >> 8u );
			return float( bits ) * 2.3283064365386963e-10; // / 0x100000000

		}

		// Hammersley sequence
		vec2 hammersley( uint i, uint N ) {

			return vec2( float( i ) / float( N ), radicalInverse_VdC( i ) );

		}

		void main() {

			vec3 N = normalize( vWorldDirection );

			// For very low roughness, just sample the environment directly
			if ( roughness < 0.001 ) {

				gl_FragColor = vec4( textureLod( envMap, N, 0.0 ).rgb, 1.0 );
				return;

			}

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			// Tangent space basis for VNDF sampling
			vec3 up = abs( N.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, N ) );
			vec3 bitangent = cross( N, tangent );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			for ( uint i = 0u; i < GGX_SAMPLES; i ++ ) {

				vec2 Xi = hammersley( i, GGX_SAMPLES );

				// With V = N, sample the reflected direction directly.
				float invQ = 1.0 / ( 1.0 - Xi.x + alpha2 * Xi.x );
				float NdotL = ( 1.0 - Xi.x - alpha2 * Xi.x ) * invQ;

				if ( NdotL > 0.0 ) {

					float phi = 2.0 * PI * Xi.y;
					float sinTheta = 2.0 * alpha * sqrt( Xi.x * ( 1.0 - Xi.x ) ) * invQ;
					vec3 L = N * NdotL + ( tangent * cos( phi ) + bitangent * sin( phi ) ) * sinTheta;

					// Match the source mip to the sample's solid angle. The terms
					// independent of the sample are precomputed in lodBias.
					float d = alpha2 * invQ;
					float lod = max( log2( d ) + lodBias, 0.0 );

					// Weight by NdotL for the split-sum approximation
					prefilteredColor += textureLod( envMap, L, lod ).rgb * NdotL;
					totalWeight += NdotL;

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function Gw(){return Rl("PMREMGGXIntegration",{envMap:{value:null},roughness:{value:0},sourceLod:{value:0},sourceSize:{value:g0}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float sourceLod;
		uniform int sourceSize;

		void main() {

			vec3 N = normalize( vWorldDirection );

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			float texelSize = 2.0 / float( sourceSize );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			// Pair opposite texels: only the one in N's hemisphere contributes.
			for ( int face = 0; face < 3; face ++ ) {

				for ( int y = 0; y < sourceSize; y ++ ) {

					for ( int x = 0; x < sourceSize; x ++ ) {

						vec2 uv = ( vec2( x, y ) + 0.5 ) * texelSize - 1.0;
						vec3 texelDirection = face == 0 ? vec3( 1.0, uv ) : ( face == 1 ? vec3( uv.x, 1.0, uv.y ) : vec3( uv, 1.0 ) );

						float invDistance = inversesqrt( 1.0 + dot( uv, uv ) );
						float NdotL = dot( N, texelDirection );
						texelDirection *= NdotL < 0.0 ? - 1.0 : 1.0;
						NdotL = abs( NdotL ) * invDistance;

						// With V = N, NdotH squared is ( 1 + NdotL ) / 2. Common factors
						// in the GGX distribution and texel solid angle cancel when normalized.
						float d = 1.0 + alpha2 + ( alpha2 - 1.0 ) * NdotL;
						float weight = NdotL * invDistance * invDistance * invDistance / ( d * d );

						prefilteredColor += textureLod( envMap, texelDirection, sourceLod ).rgb * weight;
						totalWeight += weight;

					}

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function Hw(){return Rl("PMREMSphericalGaussianBlur",{envMap:{value:null},sigma:{value:0}},`

		#define SAMPLES ${Fw}
		#define GOLDEN_ANGLE 2.39996322973

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float sigma;

		#include <common>

		void main() {

			vec3 outputDirection = normalize( vWorldDirection );

			vec3 up = abs( outputDirection.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, outputDirection ) );
			vec3 bitangent = cross( outputDirection, tangent );

			// Truncate the kernel at three standard deviations or at the antipode.
			float thetaMax = min( 3.0 * sigma, PI );
			float truncation = 1.0 - exp( - 0.5 * thetaMax * thetaMax / ( sigma * sigma ) );

			vec3 accumColor = vec3( 0.0 );
			float accumWeight = 0.0;

			for ( int i = 0; i < SAMPLES; i ++ ) {

				// Stratified inverse-CDF sampling of the Gaussian, placed on a golden-angle spiral.
				float stratum = ( float( i ) + 0.5 ) / float( SAMPLES );
				float theta = sigma * sqrt( - 2.0 * log( 1.0 - stratum * truncation ) );
				float phi = float( i ) * GOLDEN_ANGLE;

				vec3 offset = cos( phi ) * tangent + sin( phi ) * bitangent;
				vec3 sampleDirection = cos( theta ) * outputDirection + sin( theta ) * offset;

				// Correct the planar sample density to solid angle.
				float weight = sin( theta ) / theta;

				accumColor += weight * textureLod( envMap, sampleDirection, 0.0 ).rgb;
				accumWeight += weight;

			}

			gl_FragColor = vec4( accumColor / accumWeight, 1.0 );

		}
	`)}function $_(){return Rl("PMREMEquirectangularToCubemap",{envMap:{value:null}},`

		varying vec3 vWorldDirection;

		uniform sampler2D envMap;

		#include <common>

		void main() {

			// Average four subpixel samples to preserve small, bright features.
			vec3 direction = normalize( vWorldDirection );
			vec3 dx = dFdx( direction ) * 0.25;
			vec3 dy = dFdy( direction ) * 0.25;

			vec3 color = textureLod( envMap, equirectUv( normalize( direction - dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction - dx + dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx + dy ) ), 0.0 ).rgb;
			gl_FragColor = vec4( color * 0.25, 1.0 );

		}
	`)}function Z_(){return Rl("PMREMCubemapToCubemap",{envMap:{value:null},flipEnvMap:{value:-1}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float flipEnvMap;

		void main() {

			gl_FragColor = vec4( textureCube( envMap, vec3( flipEnvMap * vWorldDirection.x, vWorldDirection.yz ) ).rgb, 1.0 );

		}
	`)}function Ww(n){let e=new WeakMap,t=new WeakMap,i=null;function s(d,p=!1){return d==null?null:p?o(d):r(d)}function r(d){if(d&&d.isTexture){let p=d.mapping;if(p===Su||p===Mu)if(e.has(d)){let g=e.get(d).texture;return a(g,d.mapping)}else{let g=d.image;if(g&&g.height>0){let v=new Cl(g.height);return v.fromEquirectangularTexture(n,d),e.set(d,v),d.addEventListener("dispose",c),a(v.texture,d.mapping)}else return null}}return d}function o(d){if(d&&d.isTexture&&d.isPMREMTexture!==!0){let p=d.mapping,g=p===Su||p===Mu,v=p===Hr||p===jo;if(g||v){let m=t.get(d),_=m!==void 0?m.texture.pmremVersion:0;if(d.isRenderTargetTexture&&d.pmremVersion!==_)return i===null&&(i=new hh(n)),m=g?i.fromEquirectangular(d,m):i.fromCubemap(d,m),m.texture.pmremVersion=d.pmremVersion,t.set(d,m),m.texture;if(m!==void 0)return m.texture;{let x=d.image;return g&&x&&x.height>0||v&&x&&l(x)?(i===null&&(i=new hh(n)),m=g?i.fromEquirectangular(d):i.fromCubemap(d),m.texture.pmremVersion=d.pmremVersion,t.set(d,m),d.addEventListener("dispose",u),m.texture):null}}}return d}function a(d,p){return p===Su?d.mapping=Hr:p===Mu&&(d.mapping=jo),d}function l(d){let p=0,g=6;for(let v=0;v<g;v++)d[v]!==void 0&&p++;return p===g}function c(d){let p=d.target;p.removeEventListener("dispose",c);let g=e.get(p);g!==void 0&&(e.delete(p),g.dispose())}function u(d){let p=d.target;p.removeEventListener("dispose",u);let g=t.get(p);g!==void 0&&(t.delete(p),g.dispose())}function f(){e=new WeakMap,t=new WeakMap,i!==null&&(i.dispose(),i=null)}return{get:s,dispose:f}}function Xw(n){let e={};function t(i){if(e[i]!==void 0)return e[i];let s=n.getExtension(i);return e[i]=s,s}return{has:function(i){return t(i)!==null},init:function(){t("EXT_color_buffer_float"),t("WEBGL_clip_cull_distance"),t("OES_texture_float_linear"),t("EXT_color_buffer_half_float"),t("WEBGL_multisampled_render_to_texture"),t("WEBGL_render_shared_exponent")},get:function(i){let s=t(i);return s===null&&za("WebGLRenderer: "+i+" extension not supported."),s}}}function qw(n,e,t,i){let s={},r=new WeakMap,o=new FinalizationRegistry(g=>delete s[g]);function a(g){l(g.target)}function l(g){g.index!==null&&e.remove(g.index);for(let m in g.attributes)e.remove(g.attributes[m]);g.removeEventListener("dispose",a),delete s[g.id],o.unregister(g);let v=r.get(g);v&&(e.remove(v),r.delete(g)),i.releaseStatesOfGeometry(g),g.isInstancedBufferGeometry===!0&&delete g._maxInstanceCount,t.memory.geometries--}function c(g,v){return s[v.id]!==void 0||(v.addEventListener("dispose",a),s[v.id]=new WeakRef(v),o.register(v,v.id,v),t.memory.geometries++),v}function u(g){let v=g.attributes;for(let m in v)e.update(v[m],n.ARRAY_BUFFER)}function f(g){let v=g.index,m=g.attributes.position,_=0;if(m===void 0)return;let x=v!==null?v.array.length:m.array.length/3-1,T=m.count>=65535?Ja:Za,S=new T(Math.ceil(x/3)*6,1),R=S.array;if(v!==null){let y=v.array;_=v.version;for(let M=0,N=0;M<x;M+=3){let P=y[M+0],D=y[M+1],z=y[M+2];R[N++]=P,R[N++]=D,R[N++]=D,R[N++]=z,R[N++]=z,R[N++]=P}}else{_=m.version;for(let y=0,M=0;y<x;y+=3){let N=y+0,P=y+1,D=y+2;R[M++]=N,R[M++]=P,R[M++]=P,R[M++]=D,R[M++]=D,R[M++]=N}}S.version=_;let C=r.get(g);C&&e.remove(C),r.set(g,S)}function d(g){let v=r.get(g);if(v){let m=g.index;m!==null&&v.version<m.version&&f(g)}else f(g);return r.get(g)}function p(){for(let g in s){let v=s[g].deref();v!==void 0&&l(v)}}return{get:c,update:u,getWireframeAttribute:d,dispose:p}}function Yw(n,e,t){let i;function s(f){i=f}let r,o;function a(f){r=f.type,o=f.bytesPerElement}function l(f,d){n.drawElements(i,d,r,f*o),t.update(d,i,1)}function c(f,d,p){p!==0&&(n.drawElementsInstanced(i,d,r,f*o,p),t.update(d,i,p))}function u(f,d,p){if(p===0)return;e.get("WEBGL_multi_draw").multiDrawElementsWEBGL(i,d,0,r,f,0,p);let v=0;for(let m=0;m<p;m++)v+=d[m];t.update(v,i,1)}this.setMode=s,this.setIndex=a,this.render=l,this.renderInstances=c,this.renderMultiDraw=u}function $w(n){let e={geometries:0,textures:0},t={frame:0,calls:0,triangles:0,points:0,lines:0};function i(r,o,a){switch(t.calls++,o){case n.TRIANGLES:t.triangles+=a*(r/3);break;case n.LINES:t.lines+=a*(r/2);break;case n.LINE_STRIP:t.lines+=a*(r-1);break;case n.LINE_LOOP:t.lines+=a*r;break;case n.POINTS:t.points+=a*r;break;default:Qe("WebGLInfo: Unknown draw mode:",o);break}}function s(){t.calls=0,t.triangles=0,t.points=0,t.lines=0}return{memory:e,render:t,programs:null,autoReset:!0,reset:s,update:i}}function Zw(n,e,t){let i=new WeakMap,s=new Nt;function r(o,a,l){let c=o.morphTargetInfluences,u=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,f=u!==void 0?u.length:0,d=i.get(a);if(d===void 0||d.count!==f){let N=function(){y.dispose(),i.delete(a),a.removeEventListener("dispose",N)};d!==void 0&&d.texture.dispose();let p=a.morphAttributes.position!==void 0,g=a.morphAttributes.normal!==void 0,v=a.morphAttributes.color!==void 0,m=a.morphAttributes.position||[],_=a.morphAttributes.normal||[],x=a.morphAttributes.color||[],T=0;p===!0&&(T=1),g===!0&&(T=2),v===!0&&(T=3);let S=a.attributes.position.count*T,R=1;S>e.maxTextureSize&&(R=Math.ceil(S/e.maxTextureSize),S=e.maxTextureSize);let C=new Float32Array(S*R*4*f),y=new Ya(C,S,R,f);y.type=rs,y.needsUpdate=!0;let M=T*4;for(let P=0;P<f;P++){let D=m[P],z=_[P],G=x[P],U=S*R*4*P;for(let W=0;W<D.count;W++){let $=W*M;p===!0&&(s.fromBufferAttribute(D,W),C[U+$+0]=s.x,C[U+$+1]=s.y,C[U+$+2]=s.z,C[U+$+3]=0),g===!0&&(s.fromBufferAttribute(z,W),C[U+$+4]=s.x,C[U+$+5]=s.y,C[U+$+6]=s.z,C[U+$+7]=0),v===!0&&(s.fromBufferAttribute(G,W),C[U+$+8]=s.x,C[U+$+9]=s.y,C[U+$+10]=s.z,C[U+$+11]=G.itemSize===4?s.w:1)}}d={count:f,texture:y,size:new Xe(S,R)},i.set(a,d),a.addEventListener("dispose",N)}if(o.isInstancedMesh===!0&&o.morphTexture!==null)l.getUniforms().setValue(n,"morphTexture",o.morphTexture,t);else{let p=0;for(let v=0;v<c.length;v++)p+=c[v];let g=a.morphTargetsRelative?1:1-p;l.getUniforms().setValue(n,"morphTargetBaseInfluence",g),l.getUniforms().setValue(n,"morphTargetInfluences",c)}l.getUniforms().setValue(n,"morphTargetsTexture",d.texture,t),l.getUniforms().setValue(n,"morphTargetsTextureSize",d.size)}return{update:r}}function Jw(n,e,t,i,s){let r=new WeakMap;function o(c){let u=s.render.frame,f=c.geometry,d=e.get(c,f);if(r.get(d)!==u&&(e.update(d),r.set(d,u)),c.isInstancedMesh&&(c.hasEventListener("dispose",l)===!1&&c.addEventListener("dispose",l),r.get(c)!==u&&(t.update(c.instanceMatrix,n.ARRAY_BUFFER),c.instanceColor!==null&&t.update(c.instanceColor,n.ARRAY_BUFFER),r.set(c,u))),c.isSkinnedMesh){let p=c.skeleton;r.get(p)!==u&&(p.update(),r.set(p,u))}return d}function a(){r=new WeakMap}function l(c){let u=c.target;u.removeEventListener("dispose",l),i.releaseStatesOfObject(u),t.remove(u.instanceMatrix),u.instanceColor!==null&&t.remove(u.instanceColor)}return{update:o,dispose:a}}var Kw={[Cf]:"LINEAR_TONE_MAPPING",[Rf]:"REINHARD_TONE_MAPPING",[Pf]:"CINEON_TONE_MAPPING",[If]:"ACES_FILMIC_TONE_MAPPING",[Df]:"AGX_TONE_MAPPING",[Nf]:"NEUTRAL_TONE_MAPPING",[Lf]:"CUSTOM_TONE_MAPPING"};function jw(n,e,t,i,s,r){let o=new Pi(e,t,{type:n,depthBuffer:s,stencilBuffer:r,samples:i?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1}),a=null,l=null,c=null,u=new en;u.setAttribute("position",new Mt([-1,3,0,-1,-1,0,3,-1,0],3)),u.setAttribute("uv",new Mt([0,2,0,0,2,0],2));let f=new au({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),d=new Ne(u,f),p=new hl(-1,1,1,-1,0,1),g=null,v=null,m=!1,_,x=null,T=[],S=!1;this.setSize=function(R,C){o.setSize(R,C),a!==null&&a.setSize(R,C),l!==null&&l.setSize(R,C);for(let y=0;y<T.length;y++){let M=T[y];M.setSize&&M.setSize(R,C)}},this.setEffects=function(R){T=R,S=T.length>0&&T[0].isRenderPass===!0;let C=o.width,y=o.height;T.length>0&&a===null&&(a=new Pi(C,y,{type:os,depthBuffer:!1,stencilBuffer:!1}),l=new Pi(C,y,{type:os,depthBuffer:!1,stencilBuffer:!1}));let M=s===!0&&T.some(N=>N.needsDepthTexture===!0);M!==(o.depthTexture!==null)&&(M===!0&&c===null&&(c=new Hs(C,y),r===!0&&(c.format=qs,c.type=Wr)),o.dispose(),o.depthTexture=M?c:null,o.resolveDepthBuffer=M,o.storeMultisampledDepthBuffer=M);for(let N=0;N<T.length;N++){let P=T[N];P.setSize&&P.setSize(C,y),M&&P.needsDepthTexture===!0&&P.setDepthTexture&&P.setDepthTexture(c)}},this.begin=function(R,C){if(m||R.toneMapping===Ss&&T.length===0)return!1;if(x=C,C!==null){let y=C.width,M=C.height;(o.width!==y||o.height!==M)&&this.setSize(y,M)}return S===!1&&R.setRenderTarget(o),_=R.toneMapping,R.toneMapping=Ss,!0},this.hasRenderPass=function(){return S},this.end=function(R,C){R.toneMapping=_,m=!0;let y=o,M=a;for(let N=0;N<T.length;N++){let P=T[N];P.enabled!==!1&&(P.render(R,M,y,C),P.needsSwap!==!1&&(y=M,M=M===a?l:a))}if(g!==R.outputColorSpace||v!==R.toneMapping){g=R.outputColorSpace,v=R.toneMapping,f.defines={},St.getTransfer(g)===Dt&&(f.defines.SRGB_TRANSFER="");let N=Kw[v];N&&(f.defines[N]=""),f.needsUpdate=!0}f.uniforms.tDiffuse.value=y.texture,R.setRenderTarget(x),R.render(d,p),x=null,m=!1},this.isCompositing=function(){return m},this.dispose=function(){o.dispose(),a!==null&&a.dispose(),l!==null&&l.dispose(),u.dispose(),f.dispose()}}var _0=new fi,v0=new Hs(1,1),x0=new il(1),y0=new Ya,b0=new tu,S0=new tl,J_=[],K_=[],j_=new Float32Array(16),Q_=new Float32Array(9),e0=new Float32Array(4);function ta(n,e,t){let i=n[0];if(i<=0||i>0)return n;let s=e*t,r=J_[s];if(r===void 0&&(r=new Float32Array(s),J_[s]=r),e!==0){i.toArray(r,0);for(let o=1,a=0;o!==e;++o)a+=t,n[o].toArray(r,a)}return r}function Nn(n,e){if(n.length!==e.length)return!1;for(let t=0,i=n.length;t<i;t++)if(n[t]!==e[t])return!1;return!0}function Un(n,e){for(let t=0,i=e.length;t<i;t++)n[t]=e[t]}function fh(n,e){let t=K_[e];t===void 0&&(t=new Int32Array(e),K_[e]=t);for(let i=0;i!==e;++i)t[i]=n.allocateTextureUnit();return t}function Qw(n,e){let t=this.cache;t[0]!==e&&(n.uniform1f(this.addr,e),t[0]=e)}function e1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2f(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Nn(t,e))return;n.uniform2fv(this.addr,e),Un(t,e)}}function t1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3f(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else if(e.r!==void 0)(t[0]!==e.r||t[1]!==e.g||t[2]!==e.b)&&(n.uniform3f(this.addr,e.r,e.g,e.b),t[0]=e.r,t[1]=e.g,t[2]=e.b);else{if(Nn(t,e))return;n.uniform3fv(this.addr,e),Un(t,e)}}function n1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4f(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Nn(t,e))return;n.uniform4fv(this.addr,e),Un(t,e)}}function i1(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Nn(t,e))return;n.uniformMatrix2fv(this.addr,!1,e),Un(t,e)}else{if(Nn(t,i))return;e0.set(i),n.uniformMatrix2fv(this.addr,!1,e0),Un(t,i)}}function s1(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Nn(t,e))return;n.uniformMatrix3fv(this.addr,!1,e),Un(t,e)}else{if(Nn(t,i))return;Q_.set(i),n.uniformMatrix3fv(this.addr,!1,Q_),Un(t,i)}}function r1(n,e){let t=this.cache,i=e.elements;if(i===void 0){if(Nn(t,e))return;n.uniformMatrix4fv(this.addr,!1,e),Un(t,e)}else{if(Nn(t,i))return;j_.set(i),n.uniformMatrix4fv(this.addr,!1,j_),Un(t,i)}}function o1(n,e){let t=this.cache;t[0]!==e&&(n.uniform1i(this.addr,e),t[0]=e)}function a1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2i(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Nn(t,e))return;n.uniform2iv(this.addr,e),Un(t,e)}}function l1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3i(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(Nn(t,e))return;n.uniform3iv(this.addr,e),Un(t,e)}}function c1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4i(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Nn(t,e))return;n.uniform4iv(this.addr,e),Un(t,e)}}function u1(n,e){let t=this.cache;t[0]!==e&&(n.uniform1ui(this.addr,e),t[0]=e)}function h1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y)&&(n.uniform2ui(this.addr,e.x,e.y),t[0]=e.x,t[1]=e.y);else{if(Nn(t,e))return;n.uniform2uiv(this.addr,e),Un(t,e)}}function d1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z)&&(n.uniform3ui(this.addr,e.x,e.y,e.z),t[0]=e.x,t[1]=e.y,t[2]=e.z);else{if(Nn(t,e))return;n.uniform3uiv(this.addr,e),Un(t,e)}}function f1(n,e){let t=this.cache;if(e.x!==void 0)(t[0]!==e.x||t[1]!==e.y||t[2]!==e.z||t[3]!==e.w)&&(n.uniform4ui(this.addr,e.x,e.y,e.z,e.w),t[0]=e.x,t[1]=e.y,t[2]=e.z,t[3]=e.w);else{if(Nn(t,e))return;n.uniform4uiv(this.addr,e),Un(t,e)}}function ph(n){return n.version===0&&(n.compareFunction=Xf,n.needsUpdate=!0),n}function p1(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_2D_SHADOW?r=ph(v0):r=_0,t.setTexture2D(e||r,s)}function m1(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture3D(e||b0,s)}function g1(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_CUBE_SHADOW?r=ph(x0):r=S0,t.setTextureCube(e||r,s)}function _1(n,e,t){let i=this.cache,s=t.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),t.setTexture2DArray(e||y0,s)}function v1(n){switch(n){case 5126:return Qw;case 35664:return e1;case 35665:return t1;case 35666:return n1;case 35674:return i1;case 35675:return s1;case 35676:return r1;case 5124:case 35670:return o1;case 35667:case 35671:return a1;case 35668:case 35672:return l1;case 35669:case 35673:return c1;case 5125:return u1;case 36294:return h1;case 36295:return d1;case 36296:return f1;case 35678:case 36198:case 36298:case 36306:case 35682:return p1;case 35679:case 36299:case 36307:return m1;case 35680:case 36300:case 36308:case 36293:return g1;case 36289:case 36303:case 36311:case 36292:return _1}}function x1(n,e){n.uniform1fv(this.addr,e)}function y1(n,e){let t=ta(e,this.size,2);n.uniform2fv(this.addr,t)}function b1(n,e){let t=ta(e,this.size,3);n.uniform3fv(this.addr,t)}function S1(n,e){let t=ta(e,this.size,4);n.uniform4fv(this.addr,t)}function M1(n,e){let t=ta(e,this.size,4);n.uniformMatrix2fv(this.addr,!1,t)}function w1(n,e){let t=ta(e,this.size,9);n.uniformMatrix3fv(this.addr,!1,t)}function T1(n,e){let t=ta(e,this.size,16);n.uniformMatrix4fv(this.addr,!1,t)}function E1(n,e){n.uniform1iv(this.addr,e)}function A1(n,e){n.uniform2iv(this.addr,e)}function C1(n,e){n.uniform3iv(this.addr,e)}function R1(n,e){n.uniform4iv(this.addr,e)}function P1(n,e){n.uniform1uiv(this.addr,e)}function I1(n,e){n.uniform2uiv(this.addr,e)}function L1(n,e){n.uniform3uiv(this.addr,e)}function D1(n,e){n.uniform4uiv(this.addr,e)}function N1(n,e,t){let i=this.cache,s=e.length,r=fh(t,s);Nn(i,r)||(n.uniform1iv(this.addr,r),Un(i,r));let o;this.type===n.SAMPLER_2D_SHADOW?o=ph(v0):o=_0;for(let a=0;a!==s;++a)t.setTexture2D(e[a]||o,r[a])}function U1(n,e,t){let i=this.cache,s=e.length,r=fh(t,s);Nn(i,r)||(n.uniform1iv(this.addr,r),Un(i,r));for(let o=0;o!==s;++o)t.setTexture3D(e[o]||b0,r[o])}function O1(n,e,t){let i=this.cache,s=e.length,r=fh(t,s);Nn(i,r)||(n.uniform1iv(this.addr,r),Un(i,r));let o;this.type===n.SAMPLER_CUBE_SHADOW?o=ph(x0):o=S0;for(let a=0;a!==s;++a)t.setTextureCube(e[a]||o,r[a])}function F1(n,e,t){let i=this.cache,s=e.length,r=fh(t,s);Nn(i,r)||(n.uniform1iv(this.addr,r),Un(i,r));for(let o=0;o!==s;++o)t.setTexture2DArray(e[o]||y0,r[o])}function k1(n){switch(n){case 5126:return x1;case 35664:return y1;case 35665:return b1;case 35666:return S1;case 35674:return M1;case 35675:return w1;case 35676:return T1;case 5124:case 35670:return E1;case 35667:case 35671:return A1;case 35668:case 35672:return C1;case 35669:case 35673:return R1;case 5125:return P1;case 36294:return I1;case 36295:return L1;case 36296:return D1;case 35678:case 36198:case 36298:case 36306:case 35682:return N1;case 35679:case 36299:case 36307:return U1;case 35680:case 36300:case 36308:case 36293:return O1;case 36289:case 36303:case 36311:case 36292:return F1}}var sp=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.setValue=v1(t.type)}},rp=class{constructor(e,t,i){this.id=e,this.addr=i,this.cache=[],this.type=t.type,this.size=t.size,this.setValue=k1(t.type)}},op=class{constructor(e){this.id=e,this.seq=[],this.map={}}setValue(e,t,i){let s=this.seq;for(let r=0,o=s.length;r!==o;++r){let a=s[r];a.setValue(e,t[a.id],i)}}},np=/(\w+)(\])?(\[|\.)?/g;function t0(n,e){n.seq.push(e),n.map[e.id]=e}function B1(n,e,t){let i=n.name,s=i.length;for(np.lastIndex=0;;){let r=np.exec(i),o=np.lastIndex,a=r[1],l=r[2]==="]",c=r[3];if(l&&(a=a|0),c===void 0||c==="["&&o+2===s){t0(t,c===void 0?new sp(a,n,e):new rp(a,n,e));break}else{let f=t.map[a];f===void 0&&(f=new op(a),t0(t,f)),t=f}}}var ea=class{constructor(e,t){this.seq=[],this.map={};let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS);for(let o=0;o<i;++o){let a=e.getActiveUniform(t,o),l=e.getUniformLocation(t,a.name);B1(a,l,this)}let s=[],r=[];for(let o of this.seq)o.type===e.SAMPLER_2D_SHADOW||o.type===e.SAMPLER_CUBE_SHADOW||o.type===e.SAMPLER_2D_ARRAY_SHADOW?s.push(o):r.push(o);s.length>0&&(this.seq=s.concat(r))}setValue(e,t,i,s){let r=this.map[t];r!==void 0&&r.setValue(e,i,s)}setOptional(e,t,i){let s=t[i];s!==void 0&&this.setValue(e,i,s)}static upload(e,t,i,s){for(let r=0,o=t.length;r!==o;++r){let a=t[r],l=i[a.id];l.needsUpdate!==!1&&a.setValue(e,l.value,s)}}static seqWithValue(e,t){let i=[];for(let s=0,r=e.length;s!==r;++s){let o=e[s];o.id in t&&i.push(o)}return i}};function n0(n,e,t){let i=n.createShader(e);return n.shaderSource(i,t),n.compileShader(i),i}var z1=37297,V1=0;function G1(n,e){let t=n.split(`
`),i=[],s=Math.max(e-6,0),r=Math.min(e+6,t.length);for(let o=s;o<r;o++){let a=o+1;i.push(`${a===e?">":" "} ${a}: ${t[o]}`)}return i.join(`
`)}var i0=new st;function H1(n){St._getMatrix(i0,St.workingColorSpace,n);let e=`mat3( ${i0.elements.map(t=>t.toFixed(4))} )`;switch(St.getTransfer(n)){case Wa:return[e,"LinearTransferOETF"];case Dt:return[e,"sRGBTransferOETF"];default:return Je("WebGLProgram: Unsupported color space: ",n),[e,"LinearTransferOETF"]}}function s0(n,e,t){let i=n.getShaderParameter(e,n.COMPILE_STATUS),r=(n.getShaderInfoLog(e)||"").trim();if(i&&r==="")return"";let o=/ERROR: 0:(\d+)/.exec(r);if(o){let a=parseInt(o[1]);return t.toUpperCase()+`

`+r+`

`+G1(n.getShaderSource(e),a)}else return r}function W1(n,e){let t=H1(e);return[`vec4 ${n}( vec4 value ) {`,`	return ${t[1]}( vec4( ${t[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}var X1={[Cf]:"Linear",[Rf]:"Reinhard",[Pf]:"Cineon",[If]:"ACESFilmic",[Df]:"AgX",[Nf]:"Neutral",[Lf]:"Custom"};function q1(n,e){let t=X1[e];return t===void 0?(Je("WebGLProgram: Unsupported toneMapping:",e),"vec3 "+n+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+n+"( vec3 color ) { return "+t+"ToneMapping( color ); }"}var uh=new O;function Y1(){St.getLuminanceCoefficients(uh);let n=uh.x.toFixed(4),e=uh.y.toFixed(4),t=uh.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${n}, ${e}, ${t} );`,"	return dot( weights, rgb );","}"].join(`
`)}function $1(n){return[n.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",n.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(Al).join(`
`)}function Z1(n){let e=[];for(let t in n){let i=n[t];i!==!1&&e.push("#define "+t+" "+i)}return e.join(`
`)}function J1(n,e){let t={},i=n.getProgramParameter(e,n.ACTIVE_ATTRIBUTES);for(let s=0;s<i;s++){let r=n.getActiveAttrib(e,s),o=r.name,a=1;r.type===n.FLOAT_MAT2&&(a=2),r.type===n.FLOAT_MAT3&&(a=3),r.type===n.FLOAT_MAT4&&(a=4),t[o]={type:r.type,location:n.getAttribLocation(e,o),locationSize:a}}return t}function Al(n){return n!==""}function r0(n,e){let t=e.numSpotLightShadows+e.numSpotLightMaps-e.numSpotLightShadowsWithMaps;return n.replace(/NUM_SUN_LIGHTS/g,e.numSunLights).replace(/NUM_DIR_LIGHTS/g,e.numDirLights).replace(/NUM_SPOT_LIGHTS/g,e.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,e.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,t).replace(/NUM_RECT_AREA_LIGHTS/g,e.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,e.numPointLights).replace(/NUM_HEMI_LIGHTS/g,e.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,e.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,e.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,e.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,e.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,e.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,e.numLightProbeGrids)}function o0(n,e){return n.replace(/NUM_CLIPPING_PLANES/g,e.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,e.numClippingPlanes-e.numClipIntersection)}var K1=/^[ \t]*#include +<([\w\d./]+)>/gm;function ap(n){return n.replace(K1,j1)}function j1(n,e){let t=mt[e];if(t===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+e+">");return ap(t)}var Q1=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function a0(n){return n.replace(Q1,eT)}function eT(n,e,t,i){let s="";for(let r=parseInt(e);r<parseInt(t);r++)s+=i.replace(/\[\s*i\s*\]/g,"[ "+r+" ]").replace(/UNROLLED_LOOP_INDEX/g,r);return s}function l0(n){let e=`precision ${n.precision} float;
	precision ${n.precision} int;
	precision ${n.precision} sampler2D;
	precision ${n.precision} samplerCube;
	precision ${n.precision} sampler3D;
	precision ${n.precision} sampler2DArray;
	precision ${n.precision} sampler2DShadow;
	precision ${n.precision} samplerCubeShadow;
	precision ${n.precision} sampler2DArrayShadow;
	precision ${n.precision} isampler2D;
	precision ${n.precision} isampler3D;
	precision ${n.precision} isamplerCube;
	precision ${n.precision} isampler2DArray;
	precision ${n.precision} usampler2D;
	precision ${n.precision} usampler3D;
	precision ${n.precision} usamplerCube;
	precision ${n.precision} usampler2DArray;
	`;return n.precision==="highp"?e+=`
#define HIGH_PRECISION`:n.precision==="mediump"?e+=`
#define MEDIUM_PRECISION`:n.precision==="lowp"&&(e+=`
#define LOW_PRECISION`),e}var tT={[gl]:"SHADOWMAP_TYPE_PCF",[Jo]:"SHADOWMAP_TYPE_VSM"};function nT(n){return tT[n.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}var iT={[jo]:"ENVMAP_MODE_REFRACTION"};function sT(n){return n.envMap===!1?"ENVMAP_MODE_REFLECTION":iT[n.envMapMode]||"ENVMAP_MODE_REFLECTION"}var rT={[Af]:"ENVMAP_BLENDING_MULTIPLY",[A_]:"ENVMAP_BLENDING_MIX",[C_]:"ENVMAP_BLENDING_ADD"};function oT(n){return n.envMap===!1?"ENVMAP_BLENDING_NONE":rT[n.combine]||"ENVMAP_BLENDING_NONE"}function aT(n,e,t,i){let s=n.getContext(),r=t.defines,o=t.vertexShader,a=t.fragmentShader,l=nT(t),c=t.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",u=sT(t),f=oT(t),d=$1(t),p=Z1(r),g=s.createProgram(),v,m,_=t.glslVersion?"#version "+t.glslVersion+`
`:"";t.isRawShaderMaterial?(v=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,p].filter(Al).join(`
`),v.length>0&&(v+=`
`),m=["#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,p].filter(Al).join(`
`),m.length>0&&(m+=`
`)):(v=[l0(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,p,t.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",t.batching?"#define USE_BATCHING":"",t.batchingColor?"#define USE_BATCHING_COLOR":"",t.instancing?"#define USE_INSTANCING":"",t.instancingColor?"#define USE_INSTANCING_COLOR":"",t.instancingMorph?"#define USE_INSTANCING_MORPH":"",t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.map?"#define USE_MAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+u:"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.displacementMap?"#define USE_DISPLACEMENTMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.mapUv?"#define MAP_UV "+t.mapUv:"",t.alphaMapUv?"#define ALPHAMAP_UV "+t.alphaMapUv:"",t.lightMapUv?"#define LIGHTMAP_UV "+t.lightMapUv:"",t.aoMapUv?"#define AOMAP_UV "+t.aoMapUv:"",t.emissiveMapUv?"#define EMISSIVEMAP_UV "+t.emissiveMapUv:"",t.bumpMapUv?"#define BUMPMAP_UV "+t.bumpMapUv:"",t.normalMapUv?"#define NORMALMAP_UV "+t.normalMapUv:"",t.displacementMapUv?"#define DISPLACEMENTMAP_UV "+t.displacementMapUv:"",t.metalnessMapUv?"#define METALNESSMAP_UV "+t.metalnessMapUv:"",t.roughnessMapUv?"#define ROUGHNESSMAP_UV "+t.roughnessMapUv:"",t.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+t.anisotropyMapUv:"",t.clearcoatMapUv?"#define CLEARCOATMAP_UV "+t.clearcoatMapUv:"",t.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+t.clearcoatNormalMapUv:"",t.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+t.clearcoatRoughnessMapUv:"",t.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+t.diffuseRoughnessMapUv:"",t.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+t.iridescenceMapUv:"",t.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+t.iridescenceThicknessMapUv:"",t.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+t.sheenColorMapUv:"",t.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+t.sheenRoughnessMapUv:"",t.specularMapUv?"#define SPECULARMAP_UV "+t.specularMapUv:"",t.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+t.specularColorMapUv:"",t.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+t.specularIntensityMapUv:"",t.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+t.transmissionMapUv:"",t.thicknessMapUv?"#define THICKNESSMAP_UV "+t.thicknessMapUv:"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexNormals?"#define HAS_NORMAL":"",t.vertexColors?"#define USE_COLOR":"",t.vertexAlphas?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.flatShading?"#define FLAT_SHADED":"",t.skinning?"#define USE_SKINNING":"",t.morphTargets?"#define USE_MORPHTARGETS":"",t.morphNormals&&t.flatShading===!1?"#define USE_MORPHNORMALS":"",t.morphColors?"#define USE_MORPHCOLORS":"",t.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+t.morphTextureStride:"",t.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+t.morphTargetsCount:"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.sizeAttenuation?"#define USE_SIZEATTENUATION":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(Al).join(`
`),m=[l0(t),"#define SHADER_TYPE "+t.shaderType,"#define SHADER_NAME "+t.shaderName,p,t.useFog&&t.fog?"#define USE_FOG":"",t.useFog&&t.fogExp2?"#define FOG_EXP2":"",t.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",t.map?"#define USE_MAP":"",t.matcap?"#define USE_MATCAP":"",t.envMap?"#define USE_ENVMAP":"",t.envMap?"#define "+c:"",t.envMap?"#define "+u:"",t.envMap?"#define "+f:"",t.envMapPMREM?"#define ENVMAP_MAX_LOD "+t.envMapMaxLod+".0":"",t.envMapPMREM?"#define ENVMAP_SIZE "+t.envMapSize+".0":"",t.lightMap?"#define USE_LIGHTMAP":"",t.aoMap?"#define USE_AOMAP":"",t.bumpMap?"#define USE_BUMPMAP":"",t.normalMap?"#define USE_NORMALMAP":"",t.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",t.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",t.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",t.emissiveMap?"#define USE_EMISSIVEMAP":"",t.anisotropy?"#define USE_ANISOTROPY":"",t.anisotropyMap?"#define USE_ANISOTROPYMAP":"",t.clearcoat?"#define USE_CLEARCOAT":"",t.clearcoatMap?"#define USE_CLEARCOATMAP":"",t.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",t.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",t.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",t.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",t.dispersion?"#define USE_DISPERSION":"",t.retroreflection?"#define USE_RETROREFLECTION":"",t.iridescence?"#define USE_IRIDESCENCE":"",t.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",t.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",t.specularMap?"#define USE_SPECULARMAP":"",t.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",t.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",t.roughnessMap?"#define USE_ROUGHNESSMAP":"",t.metalnessMap?"#define USE_METALNESSMAP":"",t.alphaMap?"#define USE_ALPHAMAP":"",t.alphaTest?"#define USE_ALPHATEST":"",t.alphaHash?"#define USE_ALPHAHASH":"",t.sheen?"#define USE_SHEEN":"",t.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",t.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",t.transmission?"#define USE_TRANSMISSION":"",t.transmissionMap?"#define USE_TRANSMISSIONMAP":"",t.thicknessMap?"#define USE_THICKNESSMAP":"",t.vertexTangents&&t.flatShading===!1?"#define USE_TANGENT":"",t.vertexColors||t.instancingColor?"#define USE_COLOR":"",t.vertexAlphas||t.batchingColor?"#define USE_COLOR_ALPHA":"",t.vertexUv1s?"#define USE_UV1":"",t.vertexUv2s?"#define USE_UV2":"",t.vertexUv3s?"#define USE_UV3":"",t.pointsUvs?"#define USE_POINTS_UV":"",t.gradientMap?"#define USE_GRADIENTMAP":"",t.flatShading?"#define FLAT_SHADED":"",t.doubleSided?"#define DOUBLE_SIDED":"",t.flipSided?"#define FLIP_SIDED":"",t.shadowMapEnabled?"#define USE_SHADOWMAP":"",t.shadowMapEnabled?"#define "+l:"",t.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",t.numLightProbes>0?"#define USE_LIGHT_PROBES":"",t.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",t.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",t.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",t.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",t.toneMapping!==Ss?"#define TONE_MAPPING":"",t.toneMapping!==Ss?mt.tonemapping_pars_fragment:"",t.toneMapping!==Ss?q1("toneMapping",t.toneMapping):"",t.dithering?"#define DITHERING":"",t.opaque?"#define OPAQUE":"",mt.colorspace_pars_fragment,W1("linearToOutputTexel",t.outputColorSpace),Y1(),t.useDepthPacking?"#define DEPTH_PACKING "+t.depthPacking:"",`
`].filter(Al).join(`
`)),o=ap(o),o=r0(o,t),o=o0(o,t),a=ap(a),a=r0(a,t),a=o0(a,t),o=a0(o),a=a0(a),t.isRawShaderMaterial!==!0&&(_=`#version 300 es
`,v=[d,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+v,m=["#define varying in",t.glslVersion===Yf?"":"layout(location = 0) out highp vec4 pc_fragColor;",t.glslVersion===Yf?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+m);let x=_+v+o,T=_+m+a,S=n0(s,s.VERTEX_SHADER,x),R=n0(s,s.FRAGMENT_SHADER,T);s.attachShader(g,S),s.attachShader(g,R),t.index0AttributeName!==void 0?s.bindAttribLocation(g,0,t.index0AttributeName):t.hasPositionAttribute===!0&&s.bindAttribLocation(g,0,"position"),s.linkProgram(g);function C(P){if(n.debug.checkShaderErrors){let D=s.getProgramInfoLog(g)||"",z=s.getShaderInfoLog(S)||"",G=s.getShaderInfoLog(R)||"",U=D.trim(),W=z.trim(),$=G.trim(),H=!0,le=!0;if(s.getProgramParameter(g,s.LINK_STATUS)===!1)if(H=!1,typeof n.debug.onShaderError=="function")n.debug.onShaderError(s,g,S,R);else{let Y=s0(s,S,"vertex"),Q=s0(s,R,"fragment");Qe("WebGLProgram: Shader Error "+s.getError()+" - VALIDATE_STATUS "+s.getProgramParameter(g,s.VALIDATE_STATUS)+`

Material Name: `+P.name+`
Material Type: `+P.type+`

Program Info Log: `+U+`
`+Y+`
`+Q)}else U!==""?Je("WebGLProgram: Program Info Log:",U):(W===""||$==="")&&(le=!1);le&&(P.diagnostics={runnable:H,programLog:U,vertexShader:{log:W,prefix:v},fragmentShader:{log:$,prefix:m}})}s.deleteShader(S),s.deleteShader(R),y=new ea(s,g),M=J1(s,g)}let y;this.getUniforms=function(){return y===void 0&&C(this),y};let M;this.getAttributes=function(){return M===void 0&&C(this),M};let N=t.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return N===!1&&(N=s.getProgramParameter(g,z1)),N},this.destroy=function(){i.releaseStatesOfProgram(this),s.deleteProgram(g),this.program=void 0},this.type=t.shaderType,this.name=t.shaderName,this.id=V1++,this.cacheKey=e,this.usedTimes=1,this.program=g,this.vertexShader=S,this.fragmentShader=R,this}var lT=0,lp=class{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(e,t,i){let s=this._getShaderCacheForMaterial(e);return s.has(t)===!1&&(s.add(t),t.usedTimes++),s.has(i)===!1&&(s.add(i),i.usedTimes++),this}remove(e){let t=this.materialCache.get(e);for(let i of t)i.usedTimes--,i.usedTimes===0&&this.shaderCache.delete(i.code);return this.materialCache.delete(e),this}getVertexShaderStage(e){return this._getShaderStage(e.vertexShader)}getFragmentShaderStage(e){return this._getShaderStage(e.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(e){let t=this.materialCache,i=t.get(e);return i===void 0&&(i=new Set,t.set(e,i)),i}_getShaderStage(e){let t=this.shaderCache,i=t.get(e);return i===void 0&&(i=new cp(e),t.set(e,i)),i}},cp=class{constructor(e){this.id=lT++,this.code=e,this.usedTimes=0}};function cT(n){return n===yr||n===Sl||n===Ml}function uT(n,e,t,i,s,r){let o=new Go,a=new lp,l=new Set,c=[],u=new Map,f=i.logarithmicDepthBuffer,d={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function p(y){return l.add(y),y===0?"uv":`uv${y}`}function g(y,M,N,P,D,z){let G=P.fog,U=D.geometry,W=y.isMeshStandardMaterial||y.isMeshLambertMaterial||y.isMeshPhongMaterial?P.environment:null,$=y.isMeshStandardMaterial||y.isMeshLambertMaterial&&!y.envMap||y.isMeshPhongMaterial&&!y.envMap,H=e.get(y.envMap||W,$),le=d[y.type],Y=i.precision;y.precision!==null&&(Y=i.getMaxPrecision(y.precision),Y!==y.precision&&Je("WebGLProgram.getParameters:",y.precision,"not supported, using",Y,"instead."));let Q=U.morphAttributes.position||U.morphAttributes.normal||U.morphAttributes.color,ie=Q!==void 0?Q.length:0,he=0;U.morphAttributes.position!==void 0&&(he=1),U.morphAttributes.normal!==void 0&&(he=2),U.morphAttributes.color!==void 0&&(he=3);let de,ee,ge,xe;if(le){let Pe=mi[le];de=Pe.vertexShader,ee=Pe.fragmentShader}else{de=y.vertexShader,ee=y.fragmentShader;let Pe=a.getVertexShaderStage(y),dt=a.getFragmentShaderStage(y);a.update(y,Pe,dt),ge=Pe.id,xe=dt.id}let Re=n.getRenderTarget(),Me=n.state.buffers.depth.getReversed(),Ye=D.isInstancedMesh===!0,lt=D.isBatchedMesh===!0,We=!!y.map,gt=!!y.matcap,ft=!!H,rt=ft&&H.isPMREMTexture===!0,sn=!!y.aoMap,Yt=!!y.lightMap,yn=!!y.bumpMap&&y.wireframe===!1,Vt=!!y.normalMap,Bn=!!y.displacementMap,Tt=!!y.emissiveMap,In=!!y.metalnessMap,cn=!!y.roughnessMap,bn=y.anisotropy>0,B=y.clearcoat>0,Ie=y.diffuseRoughness>0,Ke=y.dispersion>0,ct=y.retroreflectivity>0,we=y.iridescence>0,Ht=y.sheen>0,He=y.transmission>0,Ze=bn&&!!y.anisotropyMap,I=B&&!!y.clearcoatMap,w=B&&!!y.clearcoatNormalMap,q=B&&!!y.clearcoatRoughnessMap,ue=Ie&&!!y.diffuseRoughnessMap,oe=we&&!!y.iridescenceMap,ve=we&&!!y.iridescenceThicknessMap,ye=Ht&&!!y.sheenColorMap,te=Ht&&!!y.sheenRoughnessMap,se=!!y.specularMap,pe=!!y.specularColorMap,k=!!y.specularIntensityMap,re=He&&!!y.transmissionMap,ne=He&&!!y.thicknessMap,Te=!!y.gradientMap,_e=!!y.alphaMap,Se=y.alphaTest>0,qe=!!y.alphaHash,et=!!y.extensions,ce=Ss;y.toneMapped&&(Re===null||Re.isXRRenderTarget===!0)&&(ce=n.toneMapping);let ze=rt?H.isCompressedCubeTexture?H.image[0].mipmaps:H.mipmaps:null,tt={shaderID:le,shaderType:y.type,shaderName:y.name,vertexShader:de,fragmentShader:ee,defines:y.defines,customVertexShaderID:ge,customFragmentShaderID:xe,isRawShaderMaterial:y.isRawShaderMaterial===!0,glslVersion:y.glslVersion,precision:Y,batching:lt,batchingColor:lt&&D._colorsTexture!==null,instancing:Ye,instancingColor:Ye&&D.instanceColor!==null,instancingMorph:Ye&&D.morphTexture!==null,outputColorSpace:Re===null?n.outputColorSpace:Re.isXRRenderTarget===!0?Re.texture.colorSpace:St.workingColorSpace,alphaToCoverage:!!y.alphaToCoverage,map:We,matcap:gt,envMap:ft,envMapMode:ft&&H.mapping,envMapPMREM:rt,envMapMaxLod:rt?ze.length-1:null,envMapSize:rt?ze[0].width:null,aoMap:sn,lightMap:Yt,bumpMap:yn,normalMap:Vt,displacementMap:Bn,emissiveMap:Tt,normalMapObjectSpace:Vt&&y.normalMapType===I_,normalMapTangentSpace:Vt&&y.normalMapType===ah,packedNormalMap:Vt&&y.normalMapType===ah&&cT(y.normalMap.format),metalnessMap:In,roughnessMap:cn,anisotropy:bn,anisotropyMap:Ze,clearcoat:B,clearcoatMap:I,clearcoatNormalMap:w,clearcoatRoughnessMap:q,diffuseRoughness:Ie,diffuseRoughnessMap:ue,dispersion:Ke,retroreflection:ct,iridescence:we,iridescenceMap:oe,iridescenceThicknessMap:ve,sheen:Ht,sheenColorMap:ye,sheenRoughnessMap:te,specularMap:se,specularColorMap:pe,specularIntensityMap:k,transmission:He,transmissionMap:re,thicknessMap:ne,gradientMap:Te,opaque:y.transparent===!1&&y.blending===Ko&&y.alphaToCoverage===!1,alphaMap:_e,alphaTest:Se,alphaHash:qe,combine:y.combine,mapUv:We&&p(y.map.channel),aoMapUv:sn&&p(y.aoMap.channel),lightMapUv:Yt&&p(y.lightMap.channel),bumpMapUv:yn&&p(y.bumpMap.channel),normalMapUv:Vt&&p(y.normalMap.channel),displacementMapUv:Bn&&p(y.displacementMap.channel),emissiveMapUv:Tt&&p(y.emissiveMap.channel),metalnessMapUv:In&&p(y.metalnessMap.channel),roughnessMapUv:cn&&p(y.roughnessMap.channel),anisotropyMapUv:Ze&&p(y.anisotropyMap.channel),clearcoatMapUv:I&&p(y.clearcoatMap.channel),clearcoatNormalMapUv:w&&p(y.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:q&&p(y.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:ue&&p(y.diffuseRoughnessMap.channel),iridescenceMapUv:oe&&p(y.iridescenceMap.channel),iridescenceThicknessMapUv:ve&&p(y.iridescenceThicknessMap.channel),sheenColorMapUv:ye&&p(y.sheenColorMap.channel),sheenRoughnessMapUv:te&&p(y.sheenRoughnessMap.channel),specularMapUv:se&&p(y.specularMap.channel),specularColorMapUv:pe&&p(y.specularColorMap.channel),specularIntensityMapUv:k&&p(y.specularIntensityMap.channel),transmissionMapUv:re&&p(y.transmissionMap.channel),thicknessMapUv:ne&&p(y.thicknessMap.channel),alphaMapUv:_e&&p(y.alphaMap.channel),vertexTangents:!!U.attributes.tangent&&(Vt||bn),vertexNormals:!!U.attributes.normal,vertexColors:y.vertexColors,vertexAlphas:y.vertexColors===!0&&!!U.attributes.color&&U.attributes.color.itemSize===4,pointsUvs:D.isPoints===!0&&!!U.attributes.uv&&(We||_e),fog:!!G,useFog:y.fog===!0,fogExp2:!!G&&G.isFogExp2,flatShading:y.wireframe===!1&&(y.flatShading===!0||U.attributes.normal===void 0&&Vt===!1&&(y.isMeshLambertMaterial||y.isMeshPhongMaterial||y.isMeshStandardMaterial||y.isMeshPhysicalMaterial)),sizeAttenuation:y.sizeAttenuation===!0,logarithmicDepthBuffer:f,reversedDepthBuffer:Me,skinning:D.isSkinnedMesh===!0,hasPositionAttribute:U.attributes.position!==void 0,morphTargets:U.morphAttributes.position!==void 0,morphNormals:U.morphAttributes.normal!==void 0,morphColors:U.morphAttributes.color!==void 0,morphTargetsCount:ie,morphTextureStride:he,numSunLights:M.sun.length,numDirLights:M.directional.length,numPointLights:M.point.length,numSpotLights:M.spot.length,numSpotLightMaps:M.spotLightMap.length,numRectAreaLights:M.rectArea.length,numHemiLights:M.hemi.length,numSunLightShadows:M.sunShadowMap.length,numDirLightShadows:M.directionalShadowMap.length,numPointLightShadows:M.pointShadowMap.length,numSpotLightShadows:M.spotShadowMap.length,numSpotLightShadowsWithMaps:M.numSpotLightShadowsWithMaps,numLightProbes:M.numLightProbes,numLightProbeGrids:z.filter(Pe=>Pe.texture!==null).length,numClippingPlanes:r.numPlanes,numClipIntersection:r.numIntersection,dithering:y.dithering,shadowMapEnabled:n.shadowMap.enabled&&N.length>0,shadowMapType:n.shadowMap.type,toneMapping:ce,decodeVideoTexture:We&&y.map.isVideoTexture===!0&&St.getTransfer(y.map.colorSpace)===Dt,decodeVideoTextureEmissive:Tt&&y.emissiveMap.isVideoTexture===!0&&St.getTransfer(y.emissiveMap.colorSpace)===Dt,premultipliedAlpha:y.premultipliedAlpha,doubleSided:y.side===xi,flipSided:y.side===pi,useDepthPacking:y.depthPacking>=0,depthPacking:y.depthPacking||0,index0AttributeName:y.index0AttributeName,extensionClipCullDistance:et&&y.extensions.clipCullDistance===!0&&t.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(et&&y.extensions.multiDraw===!0||lt)&&t.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:t.has("KHR_parallel_shader_compile"),customProgramCacheKey:y.customProgramCacheKey()};return tt.vertexUv1s=l.has(1),tt.vertexUv2s=l.has(2),tt.vertexUv3s=l.has(3),l.clear(),tt}function v(y){let M=[];if(y.shaderID?M.push(y.shaderID):(M.push(y.customVertexShaderID),M.push(y.customFragmentShaderID)),y.defines!==void 0)for(let N in y.defines)M.push(N),M.push(y.defines[N]);return y.isRawShaderMaterial===!1&&(m(M,y),_(M,y),M.push(n.outputColorSpace)),M.push(y.customProgramCacheKey),M.join()}function m(y,M){y.push(M.precision),y.push(M.outputColorSpace),y.push(M.envMapMode),y.push(M.envMapPMREM),y.push(M.envMapMaxLod),y.push(M.envMapSize),y.push(M.mapUv),y.push(M.alphaMapUv),y.push(M.lightMapUv),y.push(M.aoMapUv),y.push(M.bumpMapUv),y.push(M.normalMapUv),y.push(M.displacementMapUv),y.push(M.emissiveMapUv),y.push(M.metalnessMapUv),y.push(M.roughnessMapUv),y.push(M.anisotropyMapUv),y.push(M.clearcoatMapUv),y.push(M.clearcoatNormalMapUv),y.push(M.clearcoatRoughnessMapUv),y.push(M.diffuseRoughnessMapUv),y.push(M.iridescenceMapUv),y.push(M.iridescenceThicknessMapUv),y.push(M.sheenColorMapUv),y.push(M.sheenRoughnessMapUv),y.push(M.specularMapUv),y.push(M.specularColorMapUv),y.push(M.specularIntensityMapUv),y.push(M.transmissionMapUv),y.push(M.thicknessMapUv),y.push(M.combine),y.push(M.fogExp2),y.push(M.sizeAttenuation),y.push(M.morphTargetsCount),y.push(M.numSunLights),y.push(M.numDirLights),y.push(M.numPointLights),y.push(M.numSpotLights),y.push(M.numSpotLightMaps),y.push(M.numHemiLights),y.push(M.numRectAreaLights),y.push(M.numSunLightShadows),y.push(M.numDirLightShadows),y.push(M.numPointLightShadows),y.push(M.numSpotLightShadows),y.push(M.numSpotLightShadowsWithMaps),y.push(M.numLightProbes),y.push(M.numLightProbeGrids),y.push(M.shadowMapType),y.push(M.toneMapping),y.push(M.numClippingPlanes),y.push(M.numClipIntersection),y.push(M.depthPacking)}function _(y,M){o.disableAll(),M.instancing&&o.enable(0),M.instancingColor&&o.enable(1),M.instancingMorph&&o.enable(2),M.matcap&&o.enable(3),M.envMap&&o.enable(4),M.normalMapObjectSpace&&o.enable(5),M.normalMapTangentSpace&&o.enable(6),M.clearcoat&&o.enable(7),M.iridescence&&o.enable(8),M.alphaTest&&o.enable(9),M.vertexColors&&o.enable(10),M.vertexAlphas&&o.enable(11),M.vertexUv1s&&o.enable(12),M.vertexUv2s&&o.enable(13),M.vertexUv3s&&o.enable(14),M.vertexTangents&&o.enable(15),M.anisotropy&&o.enable(16),M.alphaHash&&o.enable(17),M.batching&&o.enable(18),M.dispersion&&o.enable(19),M.retroreflection&&o.enable(24),M.diffuseRoughness&&o.enable(25),M.batchingColor&&o.enable(20),M.gradientMap&&o.enable(21),M.packedNormalMap&&o.enable(22),M.vertexNormals&&o.enable(23),y.push(o.mask),o.disableAll(),M.fog&&o.enable(0),M.useFog&&o.enable(1),M.flatShading&&o.enable(2),M.logarithmicDepthBuffer&&o.enable(3),M.reversedDepthBuffer&&o.enable(4),M.skinning&&o.enable(5),M.morphTargets&&o.enable(6),M.morphNormals&&o.enable(7),M.morphColors&&o.enable(8),M.premultipliedAlpha&&o.enable(9),M.shadowMapEnabled&&o.enable(10),M.doubleSided&&o.enable(11),M.flipSided&&o.enable(12),M.useDepthPacking&&o.enable(13),M.dithering&&o.enable(14),M.transmission&&o.enable(15),M.sheen&&o.enable(16),M.opaque&&o.enable(17),M.pointsUvs&&o.enable(18),M.decodeVideoTexture&&o.enable(19),M.decodeVideoTextureEmissive&&o.enable(20),M.alphaToCoverage&&o.enable(21),M.numLightProbeGrids>0&&o.enable(22),M.hasPositionAttribute&&o.enable(23),y.push(o.mask)}function x(y){let M=d[y.type],N;if(M){let P=mi[M];N=Tl.clone(P.uniforms)}else N=y.uniforms;return N}function T(y,M){let N=u.get(M);return N!==void 0?++N.usedTimes:(N=new aT(n,M,y,s),c.push(N),u.set(M,N)),N}function S(y){if(--y.usedTimes===0){let M=c.indexOf(y);c[M]=c[c.length-1],c.pop(),u.delete(y.cacheKey),y.destroy()}}function R(y){a.remove(y)}function C(){a.dispose()}return{getParameters:g,getProgramCacheKey:v,getUniforms:x,acquireProgram:T,releaseProgram:S,releaseShaderCache:R,programs:c,dispose:C}}function hT(){let n=new WeakMap;function e(o){return n.has(o)}function t(o){let a=n.get(o);return a===void 0&&(a={},n.set(o,a)),a}function i(o){n.delete(o)}function s(o,a,l){n.get(o)[a]=l}function r(){n=new WeakMap}return{has:e,get:t,remove:i,update:s,dispose:r}}function dT(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.material.id!==e.material.id?n.material.id-e.material.id:n.materialVariant!==e.materialVariant?n.materialVariant-e.materialVariant:n.z!==e.z?n.z-e.z:n.id-e.id}function c0(n,e){return n.groupOrder!==e.groupOrder?n.groupOrder-e.groupOrder:n.renderOrder!==e.renderOrder?n.renderOrder-e.renderOrder:n.z!==e.z?e.z-n.z:n.id-e.id}function u0(){let n=[],e=0,t=[],i=[],s=[];function r(){e=0,t.length=0,i.length=0,s.length=0}function o(d){let p=0;return d.isInstancedMesh&&(p+=2),d.isSkinnedMesh&&(p+=1),p}function a(d,p,g,v,m,_){let x=n[e];return x===void 0?(x={id:d.id,object:d,geometry:p,material:g,materialVariant:o(d),groupOrder:v,renderOrder:d.renderOrder,z:m,group:_},n[e]=x):(x.id=d.id,x.object=d,x.geometry=p,x.material=g,x.materialVariant=o(d),x.groupOrder=v,x.renderOrder=d.renderOrder,x.z=m,x.group=_),e++,x}function l(d,p,g,v,m,_,x){x.reversedDepth===!0&&(m=-m);let T=a(d,p,g,v,m,_);g.transmission>0?i.push(T):g.transparent===!0?s.push(T):t.push(T)}function c(d,p,g,v,m,_){let x=a(d,p,g,v,m,_);g.transmission>0?i.unshift(x):g.transparent===!0?s.unshift(x):t.unshift(x)}function u(d,p){t.length>1&&t.sort(d||dT),i.length>1&&i.sort(p||c0),s.length>1&&s.sort(p||c0)}function f(){for(let d=e,p=n.length;d<p;d++){let g=n[d];if(g.id===null)break;g.id=null,g.object=null,g.geometry=null,g.material=null,g.group=null}}return{opaque:t,transmissive:i,transparent:s,init:r,push:l,unshift:c,finish:f,sort:u}}function fT(){let n=new WeakMap;function e(i,s){let r=n.get(i),o;return r===void 0?(o=new u0,n.set(i,[o])):s>=r.length?(o=new u0,r.push(o)):o=r[s],o}function t(){n=new WeakMap}return{get:e,dispose:t}}function pT(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={direction:new O,color:new it};break;case"SpotLight":t={position:new O,direction:new O,color:new it,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":t={position:new O,color:new it,distance:0,decay:0};break;case"HemisphereLight":t={direction:new O,skyColor:new it,groundColor:new it};break;case"RectAreaLight":t={color:new it,position:new O,halfWidth:new O,halfHeight:new O};break}return n[e.id]=t,t}}}function mT(){let n={};return{get:function(e){if(n[e.id]!==void 0)return n[e.id];let t;switch(e.type){case"SunLight":case"DirectionalLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Xe};break;case"SpotLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Xe};break;case"PointLight":t={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Xe,shadowCameraNear:1,shadowCameraFar:1e3};break}return n[e.id]=t,t}}}var gT=0;function _T(n,e){return(e.castShadow?2:0)-(n.castShadow?2:0)+(e.map?1:0)-(n.map?1:0)}function vT(n){let e=new pT,t=mT(),i={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let c=0;c<9;c++)i.probe.push(new O);let s=new O,r=new Et,o=new Et;function a(c){let u=0,f=0,d=0;for(let z=0;z<9;z++)i.probe[z].set(0,0,0);let p=0,g=0,v=0,m=0,_=0,x=0,T=0,S=0,R=0,C=0,y=0,M=0,N=0,P=0;c.sort(_T);for(let z=0,G=c.length;z<G;z++){let U=c[z],W=U.color,$=U.intensity,H=U.distance,le=null;if(U.shadow&&U.shadow.map&&(U.shadow.map.texture.format===yr?le=U.shadow.map.texture:le=U.shadow.map.depthTexture||U.shadow.map.texture),U.isAmbientLight)u+=W.r*$,f+=W.g*$,d+=W.b*$;else if(U.isLightProbe){for(let Y=0;Y<9;Y++)i.probe[Y].addScaledVector(U.sh.coefficients[Y],$);P++}else if(U.isSunLight){let Y=e.get(U);if(Y.color.copy(U.color).multiplyScalar(U.intensity),U.castShadow){let Q=U.shadow,ie=t.get(U);ie.shadowIntensity=Q.intensity,ie.shadowBias=Q.bias,ie.shadowNormalBias=Q.normalBias,ie.shadowRadius=Q.radius,ie.shadowMapSize.copy(Q.mapSize).multiply(Q.getFrameExtents()),i.sunShadow[g]=ie,i.sunShadowMap[g]=le;let he=Q.getViewportCount();for(let de=0;de<he;de++)i.sunShadowMatrix[v+de]=Q.getMatrix(de),i.sunShadowCascade[v+de]=Q._cascadeData[de];v+=he,g++}i.sun[p]=Y,p++}else if(U.isDirectionalLight){let Y=e.get(U);if(Y.color.copy(U.color).multiplyScalar(U.intensity),U.castShadow){let Q=U.shadow,ie=t.get(U);ie.shadowIntensity=Q.intensity,ie.shadowBias=Q.bias,ie.shadowNormalBias=Q.normalBias,ie.shadowRadius=Q.radius,ie.shadowMapSize=Q.mapSize,i.directionalShadow[m]=ie,i.directionalShadowMap[m]=le,i.directionalShadowMatrix[m]=U.shadow.matrix,R++}i.directional[m]=Y,m++}else if(U.isSpotLight){let Y=e.get(U);Y.position.setFromMatrixPosition(U.matrixWorld),Y.color.copy(W).multiplyScalar($),Y.distance=H,Y.coneCos=Math.cos(U.angle),Y.penumbraCos=Math.cos(U.angle*(1-U.penumbra)),Y.decay=U.decay,i.spot[x]=Y;let Q=U.shadow;if(U.map&&(i.spotLightMap[M]=U.map,M++,Q.updateMatrices(U),U.castShadow&&N++),i.spotLightMatrix[x]=Q.matrix,U.castShadow){let ie=t.get(U);ie.shadowIntensity=Q.intensity,ie.shadowBias=Q.bias,ie.shadowNormalBias=Q.normalBias,ie.shadowRadius=Q.radius,ie.shadowMapSize=Q.mapSize,i.spotShadow[x]=ie,i.spotShadowMap[x]=le,y++}x++}else if(U.isRectAreaLight){let Y=e.get(U);Y.color.copy(W).multiplyScalar($),Y.halfWidth.set(U.width*.5,0,0),Y.halfHeight.set(0,U.height*.5,0),i.rectArea[T]=Y,T++}else if(U.isPointLight){let Y=e.get(U);if(Y.color.copy(U.color).multiplyScalar(U.intensity),Y.distance=U.distance,Y.decay=U.decay,U.castShadow){let Q=U.shadow,ie=t.get(U);ie.shadowIntensity=Q.intensity,ie.shadowBias=Q.bias,ie.shadowNormalBias=Q.normalBias,ie.shadowRadius=Q.radius,ie.shadowMapSize=Q.mapSize,ie.shadowCameraNear=Q.camera.near,ie.shadowCameraFar=Q.camera.far,i.pointShadow[_]=ie,i.pointShadowMap[_]=le,i.pointShadowMatrix[_]=U.shadow.matrix,C++}i.point[_]=Y,_++}else if(U.isHemisphereLight){let Y=e.get(U);Y.skyColor.copy(U.color).multiplyScalar($),Y.groundColor.copy(U.groundColor).multiplyScalar($),i.hemi[S]=Y,S++}}T>0&&(n.has("OES_texture_float_linear")===!0?(i.rectAreaLTC1=Le.LTC_FLOAT_1,i.rectAreaLTC2=Le.LTC_FLOAT_2):(i.rectAreaLTC1=Le.LTC_HALF_1,i.rectAreaLTC2=Le.LTC_HALF_2)),i.ambient[0]=u,i.ambient[1]=f,i.ambient[2]=d;let D=i.hash;(D.sunLength!==p||D.directionalLength!==m||D.pointLength!==_||D.spotLength!==x||D.rectAreaLength!==T||D.hemiLength!==S||D.numSunShadows!==g||D.numDirectionalShadows!==R||D.numPointShadows!==C||D.numSpotShadows!==y||D.numSpotMaps!==M||D.numLightProbes!==P)&&(i.sun.length=p,i.directional.length=m,i.spot.length=x,i.rectArea.length=T,i.point.length=_,i.hemi.length=S,i.sunShadow.length=g,i.sunShadowMap.length=g,i.sunShadowMatrix.length=v,i.sunShadowCascade.length=v,i.directionalShadow.length=R,i.directionalShadowMap.length=R,i.directionalShadowMatrix.length=R,i.pointShadow.length=C,i.pointShadowMap.length=C,i.pointShadowMatrix.length=C,i.spotShadow.length=y,i.spotShadowMap.length=y,i.spotLightMatrix.length=y+M-N,i.spotLightMap.length=M,i.numSpotLightShadowsWithMaps=N,i.numLightProbes=P,D.sunLength=p,D.directionalLength=m,D.pointLength=_,D.spotLength=x,D.rectAreaLength=T,D.hemiLength=S,D.numSunShadows=g,D.numDirectionalShadows=R,D.numPointShadows=C,D.numSpotShadows=y,D.numSpotMaps=M,D.numLightProbes=P,i.version=gT++)}function l(c,u){let f=0,d=0,p=0,g=0,v=0,m=0,_=u.matrixWorldInverse;for(let x=0,T=c.length;x<T;x++){let S=c[x];if(S.isSunLight){let R=i.sun[f];R.direction.setFromMatrixPosition(S.matrixWorld),R.direction.transformDirection(_),f++}else if(S.isDirectionalLight){let R=i.directional[d];R.direction.setFromMatrixPosition(S.matrixWorld),s.setFromMatrixPosition(S.target.matrixWorld),R.direction.sub(s),R.direction.transformDirection(_),d++}else if(S.isSpotLight){let R=i.spot[g];R.position.setFromMatrixPosition(S.matrixWorld),R.position.applyMatrix4(_),R.direction.setFromMatrixPosition(S.matrixWorld),s.setFromMatrixPosition(S.target.matrixWorld),R.direction.sub(s),R.direction.transformDirection(_),g++}else if(S.isRectAreaLight){let R=i.rectArea[v];R.position.setFromMatrixPosition(S.matrixWorld),R.position.applyMatrix4(_),o.identity(),r.copy(S.matrixWorld),r.premultiply(_),o.extractRotation(r),R.halfWidth.set(S.width*.5,0,0),R.halfHeight.set(0,S.height*.5,0),R.halfWidth.applyMatrix4(o),R.halfHeight.applyMatrix4(o),v++}else if(S.isPointLight){let R=i.point[p];R.position.setFromMatrixPosition(S.matrixWorld),R.position.applyMatrix4(_),p++}else if(S.isHemisphereLight){let R=i.hemi[m];R.direction.setFromMatrixPosition(S.matrixWorld),R.direction.transformDirection(_),m++}}}return{setup:a,setupView:l,state:i}}function h0(n){let e=new vT(n),t=[],i=[],s=[];function r(f){u.camera=f,t.length=0,i.length=0,s.length=0}function o(f){f.isLightProbeGrid?s.push(f):t.push(f)}function a(f){i.push(f)}function l(){e.setup(t),s.sort((f,d)=>f.priority-d.priority||f.id-d.id)}function c(f){e.setupView(t,f)}let u={lightsArray:t,shadowsArray:i,lightProbeGridArray:s,camera:null,lights:e,transmissionRenderTarget:{},textureUnits:0};return{init:r,state:u,setupLights:l,setupLightsView:c,pushLight:o,pushShadow:a}}function xT(n){let e=new WeakMap;function t(s,r=0){let o=e.get(s),a;return o===void 0?(a=new h0(n),e.set(s,[a])):r>=o.length?(a=new h0(n),o.push(a)):a=o[r],a}function i(){e=new WeakMap}return{get:t,dispose:i}}var yT=`void main() {
	gl_Position = vec4( position, 1.0 );
}`,bT=`uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main() {
	const float samples = float( VSM_SAMPLES );
	float mean = 0.0;
	float squared_mean = 0.0;
	float uvStride = samples <= 1.0 ? 0.0 : 2.0 / ( samples - 1.0 );
	float uvStart = samples <= 1.0 ? 0.0 : - 1.0;
	for ( float i = 0.0; i < samples; i ++ ) {
		float uvOffset = uvStart + i * uvStride;
		#ifdef HORIZONTAL_PASS
			vec2 distribution = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( uvOffset, 0.0 ) * radius ) / resolution ).rg;
			mean += distribution.x;
			squared_mean += distribution.y * distribution.y + distribution.x * distribution.x;
		#else
			float depth = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( 0.0, uvOffset ) * radius ) / resolution ).r;
			mean += depth;
			squared_mean += depth * depth;
		#endif
	}
	mean = mean / samples;
	squared_mean = squared_mean / samples;
	float std_dev = sqrt( max( 0.0, squared_mean - mean * mean ) );
	gl_FragColor = vec4( mean, std_dev, 0.0, 1.0 );
}`,ST=[new O(1,0,0),new O(-1,0,0),new O(0,1,0),new O(0,-1,0),new O(0,0,1),new O(0,0,-1)],MT=[new O(0,-1,0),new O(0,-1,0),new O(0,0,1),new O(0,0,-1),new O(0,-1,0),new O(0,-1,0)],d0=new Et,El=new O,ip=new O;function wT(n,e,t){let i=new ur,s=new Xe,r=new Xe,o=new Nt,a=new lu,l=new cu,c={},u=t.maxTextureSize,f={[xr]:pi,[pi]:xr,[xi]:xi},d=new Gi({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new Xe},radius:{value:4}},vertexShader:yT,fragmentShader:bT}),p=d.clone();p.defines.HORIZONTAL_PASS=1;let g=new en;g.setAttribute("position",new Qi(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));let v=new Ne(g,d),m=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=gl;let _=this.type;this.render=function(C,y,M){if(m.enabled===!1||m.autoUpdate===!1&&m.needsUpdate===!1||C.length===0)return;this.type===l_&&(Je("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=gl);let N=n.getRenderTarget(),P=n.getActiveCubeFace(),D=n.getActiveMipmapLevel(),z=n.state;z.setBlending(Vr),z.buffers.depth.getReversed()===!0?z.buffers.color.setClear(0,0,0,0):z.buffers.color.setClear(1,1,1,1),z.buffers.depth.setTest(!0),z.setScissorTest(!1);let G=_!==this.type;G&&y.traverse(function(U){U.material&&(Array.isArray(U.material)?U.material.forEach(W=>W.needsUpdate=!0):U.material.needsUpdate=!0)});for(let U=0,W=C.length;U<W;U++){let $=C[U],H=$.shadow;if(H===void 0){Je("WebGLShadowMap:",$,"has no shadow.");continue}if(H.autoUpdate===!1&&H.needsUpdate===!1)continue;s.copy(H.mapSize);let le=H.getFrameExtents();s.multiply(le),r.copy(H.mapSize),(s.x>u||s.y>u)&&(s.x>u&&(r.x=Math.floor(u/le.x),s.x=r.x*le.x,H.mapSize.x=r.x),s.y>u&&(r.y=Math.floor(u/le.y),s.y=r.y*le.y,H.mapSize.y=r.y));let Y=n.state.buffers.depth.getReversed();if(H.camera._reversedDepth=Y,H.map===null||G===!0){if(H.map!==null&&(H.map.depthTexture!==null&&(H.map.depthTexture.dispose(),H.map.depthTexture=null),H.map.dispose()),this.type===Jo){if($.isPointLight){Je("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}H.map=new Pi(s.x,s.y,{format:yr,type:os,minFilter:di,magFilter:di,generateMipmaps:!1}),H.map.texture.name=$.name+".shadowMap",H.map.depthTexture=new Hs(s.x,s.y,rs),H.map.depthTexture.name=$.name+".shadowMapDepth",H.map.depthTexture.format=Vs,H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=qn,H.map.depthTexture.magFilter=qn}else $.isPointLight?(H.map=new Cl(s.x),H.map.depthTexture=new il(s.x,ss)):(H.map=new Pi(s.x,s.y),H.map.depthTexture=new Hs(s.x,s.y,ss)),H.map.depthTexture.name=$.name+".shadowMap",H.map.depthTexture.format=Vs,this.type===gl?(H.map.depthTexture.compareFunction=Y?Wf:Hf,H.map.depthTexture.minFilter=di,H.map.depthTexture.magFilter=di):(H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=qn,H.map.depthTexture.magFilter=qn);H.camera.updateProjectionMatrix()}H.map.isWebGLCubeRenderTarget!==!0&&(H.map.width!==s.x||H.map.height!==s.y)&&H.map.setSize(s.x,s.y);let Q=H.map.isWebGLCubeRenderTarget?6:H.getViewportCount();$.isPointLight!==!0&&H.updateMatrices($,M);let ie=(H.camera.layers.mask&4294967294)!==0?H.camera.layers:M.layers;for(let he=0;he<Q;he++){let de=H.getCamera(he);if($.isPointLight){let ee=H.camera,ge=H.matrix,xe=$.distance||ee.far;xe!==ee.far&&(ee.far=xe,ee.updateProjectionMatrix()),El.setFromMatrixPosition($.matrixWorld),ee.position.copy(El),ip.copy(ee.position),ip.add(ST[he]),ee.up.copy(MT[he]),ee.lookAt(ip),ee.updateMatrixWorld(),ge.makeTranslation(-El.x,-El.y,-El.z),d0.multiplyMatrices(ee.projectionMatrix,ee.matrixWorldInverse),H._frustum.setFromProjectionMatrix(d0,ee.coordinateSystem,ee.reversedDepth)}if(H.map.isWebGLCubeRenderTarget)n.setRenderTarget(H.map,he),n.clear();else{he===0&&(n.setRenderTarget(H.map),n.clear());let ee=H.getViewport(he);o.set(r.x*ee.x,r.y*ee.y,r.x*ee.z,r.y*ee.w),z.viewport(o)}i=H.getFrustum(he),S(y,M,de,$,ie,this.type)}H.isPointLightShadow!==!0&&this.type===Jo&&x(H,M),H.needsUpdate=!1}_=this.type,m.needsUpdate=!1,n.setRenderTarget(N,P,D)};function x(C,y){let M=e.update(v);d.defines.VSM_SAMPLES!==C.blurSamples&&(d.defines.VSM_SAMPLES=C.blurSamples,p.defines.VSM_SAMPLES=C.blurSamples,d.needsUpdate=!0,p.needsUpdate=!0),C.mapPass===null?C.mapPass=new Pi(s.x,s.y,{format:yr,type:os}):(C.mapPass.width!==C.map.width||C.mapPass.height!==C.map.height)&&C.mapPass.setSize(C.map.width,C.map.height),d.uniforms.shadow_pass.value=C.map.depthTexture,d.uniforms.resolution.value.set(C.map.width,C.map.height),d.uniforms.radius.value=C.radius,n.setRenderTarget(C.mapPass),n.clear(),n.renderBufferDirect(y,null,M,d,v,null),p.uniforms.shadow_pass.value=C.mapPass.texture,p.uniforms.resolution.value.set(C.map.width,C.map.height),p.uniforms.radius.value=C.radius,n.setRenderTarget(C.map),n.clear(),n.renderBufferDirect(y,null,M,p,v,null)}function T(C,y,M,N){let P=null,D=M.isPointLight===!0?C.customDistanceMaterial:C.customDepthMaterial;if(D!==void 0)P=D;else if(P=M.isPointLight===!0?l:a,n.localClippingEnabled&&y.clipShadows===!0&&Array.isArray(y.clippingPlanes)&&y.clippingPlanes.length!==0||y.displacementMap&&y.displacementScale!==0||y.alphaMap&&y.alphaTest>0||y.map&&y.alphaTest>0||y.alphaToCoverage===!0){let z=P.uuid,G=y.uuid,U=c[z];U===void 0&&(U={},c[z]=U);let W=U[G];W===void 0&&(W=P.clone(),U[G]=W,y.addEventListener("dispose",R)),P=W}if(P.visible=y.visible,P.wireframe=y.wireframe,N===Jo?P.side=y.shadowSide!==null?y.shadowSide:y.side:P.side=y.shadowSide!==null?y.shadowSide:f[y.side],P.alphaMap=y.alphaMap,P.alphaTest=y.alphaToCoverage===!0?.5:y.alphaTest,P.map=y.map,P.clipShadows=y.clipShadows,P.clippingPlanes=y.clippingPlanes,P.clipIntersection=y.clipIntersection,P.displacementMap=y.displacementMap,P.displacementScale=y.displacementScale,P.displacementBias=y.displacementBias,P.wireframeLinewidth=y.wireframeLinewidth,P.linewidth=y.linewidth,M.isPointLight===!0&&P.isMeshDistanceMaterial===!0){let z=n.properties.get(P);z.light=M}return P}function S(C,y,M,N,P,D){if(C.visible===!1)return;if(C.layers.test(P)&&(C.isMesh||C.isLine||C.isPoints)&&(C.castShadow||C.receiveShadow&&D===Jo)&&(!C.frustumCulled||C.intersectsFrustum(i))){C.modelViewMatrix.multiplyMatrices(M.matrixWorldInverse,C.matrixWorld);let U=e.update(C),W=C.material;if(Array.isArray(W)){let $=U.groups;for(let H=0,le=$.length;H<le;H++){let Y=$[H],Q=W[Y.materialIndex];if(Q&&Q.visible){let ie=T(C,Q,N,D);C.onBeforeShadow(n,C,y,M,U,ie,Y),n.renderBufferDirect(M,null,U,ie,C,Y),C.onAfterShadow(n,C,y,M,U,ie,Y)}}}else if(W.visible){let $=T(C,W,N,D);C.onBeforeShadow(n,C,y,M,U,$,null),n.renderBufferDirect(M,null,U,$,C,null),C.onAfterShadow(n,C,y,M,U,$,null)}}let G=C.children;for(let U=0,W=G.length;U<W;U++)S(G[U],y,M,N,P,D)}function R(C){C.target.removeEventListener("dispose",R);for(let M in c){let N=c[M],P=C.target.uuid;P in N&&(N[P].dispose(),delete N[P])}}}function TT(n,e){function t(){let k=!1,re=new Nt,ne=null,Te=new Nt(0,0,0,0);return{setMask:function(_e){ne!==_e&&!k&&(n.colorMask(_e,_e,_e,_e),ne=_e)},setLocked:function(_e){k=_e},setClear:function(_e,Se,qe,et,ce){ce===!0&&(_e*=et,Se*=et,qe*=et),re.set(_e,Se,qe,et),Te.equals(re)===!1&&(n.clearColor(_e,Se,qe,et),Te.copy(re))},reset:function(){k=!1,ne=null,Te.set(-1,0,0,0)}}}function i(){let k=!1,re=!1,ne=null,Te=null,_e=null;return{setReversed:function(Se){if(re!==Se){let qe=e.get("EXT_clip_control");Se?qe.clipControlEXT(qe.LOWER_LEFT_EXT,qe.ZERO_TO_ONE_EXT):qe.clipControlEXT(qe.LOWER_LEFT_EXT,qe.NEGATIVE_ONE_TO_ONE_EXT),re=Se;let et=_e;_e=null,this.setClear(et)}},getReversed:function(){return re},setTest:function(Se){Se?Me(n.DEPTH_TEST):Ye(n.DEPTH_TEST)},setMask:function(Se){ne!==Se&&!k&&(n.depthMask(Se),ne=Se)},setFunc:function(Se){if(re&&(Se=V_[Se]),Te!==Se){switch(Se){case Hc:n.depthFunc(n.NEVER);break;case Wc:n.depthFunc(n.ALWAYS);break;case Xc:n.depthFunc(n.LESS);break;case Fo:n.depthFunc(n.LEQUAL);break;case qc:n.depthFunc(n.EQUAL);break;case Yc:n.depthFunc(n.GEQUAL);break;case $c:n.depthFunc(n.GREATER);break;case Zc:n.depthFunc(n.NOTEQUAL);break;default:n.depthFunc(n.LEQUAL)}Te=Se}},setLocked:function(Se){k=Se},setClear:function(Se){_e!==Se&&(_e=Se,re&&(Se=1-Se),n.clearDepth(Se))},reset:function(){k=!1,ne=null,Te=null,_e=null,re=!1}}}function s(){let k=!1,re=null,ne=null,Te=null,_e=null,Se=null,qe=null,et=null,ce=null;return{setTest:function(ze){k||(ze?Me(n.STENCIL_TEST):Ye(n.STENCIL_TEST))},setMask:function(ze){re!==ze&&!k&&(n.stencilMask(ze),re=ze)},setFunc:function(ze,tt,Pe){(ne!==ze||Te!==tt||_e!==Pe)&&(n.stencilFunc(ze,tt,Pe),ne=ze,Te=tt,_e=Pe)},setOp:function(ze,tt,Pe){(Se!==ze||qe!==tt||et!==Pe)&&(n.stencilOp(ze,tt,Pe),Se=ze,qe=tt,et=Pe)},setLocked:function(ze){k=ze},setClear:function(ze){ce!==ze&&(n.clearStencil(ze),ce=ze)},reset:function(){k=!1,re=null,ne=null,Te=null,_e=null,Se=null,qe=null,et=null,ce=null}}}let r=new t,o=new i,a=new s,l={},c=new WeakMap,u={},f={},d={},p=new WeakMap,g=[],v=null,m=!1,_=null,x=null,T=null,S=null,R=null,C=null,y=null,M=new it(0,0,0),N=0,P=!1,D=null,z=null,G=null,U=null,W=null,$=n.getParameter(n.MAX_COMBINED_TEXTURE_IMAGE_UNITS),H=!1,le=0,Y=n.getParameter(n.VERSION);Y.indexOf("WebGL")!==-1?(le=parseFloat(/^WebGL (\d)/.exec(Y)[1]),H=le>=1):Y.indexOf("OpenGL ES")!==-1&&(le=parseFloat(/^OpenGL ES (\d)/.exec(Y)[1]),H=le>=2);let Q=null,ie={},he=n.getParameter(n.SCISSOR_BOX),de=n.getParameter(n.VIEWPORT),ee=new Nt().fromArray(he),ge=new Nt().fromArray(de);function xe(k,re,ne,Te){let _e=new Uint8Array(4),Se=n.createTexture();n.bindTexture(k,Se),n.texParameteri(k,n.TEXTURE_MIN_FILTER,n.NEAREST),n.texParameteri(k,n.TEXTURE_MAG_FILTER,n.NEAREST);for(let qe=0;qe<ne;qe++)k===n.TEXTURE_3D||k===n.TEXTURE_2D_ARRAY?n.texImage3D(re,0,n.RGBA,1,1,Te,0,n.RGBA,n.UNSIGNED_BYTE,_e):n.texImage2D(re+qe,0,n.RGBA,1,1,0,n.RGBA,n.UNSIGNED_BYTE,_e);return Se}let Re={};Re[n.TEXTURE_2D]=xe(n.TEXTURE_2D,n.TEXTURE_2D,1),Re[n.TEXTURE_CUBE_MAP]=xe(n.TEXTURE_CUBE_MAP,n.TEXTURE_CUBE_MAP_POSITIVE_X,6),Re[n.TEXTURE_2D_ARRAY]=xe(n.TEXTURE_2D_ARRAY,n.TEXTURE_2D_ARRAY,1,1),Re[n.TEXTURE_3D]=xe(n.TEXTURE_3D,n.TEXTURE_3D,1,1),r.setClear(0,0,0,1),o.setClear(1),a.setClear(0),Me(n.DEPTH_TEST),o.setFunc(Fo),yn(!1),Vt(bf),Me(n.CULL_FACE),sn(Vr);function Me(k){u[k]!==!0&&(n.enable(k),u[k]=!0)}function Ye(k){u[k]!==!1&&(n.disable(k),u[k]=!1)}function lt(k,re){return d[k]!==re?(n.bindFramebuffer(k,re),d[k]=re,k===n.DRAW_FRAMEBUFFER&&(d[n.FRAMEBUFFER]=re),k===n.FRAMEBUFFER&&(d[n.DRAW_FRAMEBUFFER]=re),!0):!1}function We(k,re){let ne=g,Te=!1;if(k){ne=p.get(re),ne===void 0&&(ne=[],p.set(re,ne));let _e=k.textures;if(ne.length!==_e.length||ne[0]!==n.COLOR_ATTACHMENT0){for(let Se=0,qe=_e.length;Se<qe;Se++)ne[Se]=n.COLOR_ATTACHMENT0+Se;ne.length=_e.length,Te=!0}}else ne[0]!==n.BACK&&(ne[0]=n.BACK,Te=!0);Te&&n.drawBuffers(ne)}function gt(k){return v!==k?(n.useProgram(k),v=k,!0):!1}let ft={[Gr]:n.FUNC_ADD,[u_]:n.FUNC_SUBTRACT,[h_]:n.FUNC_REVERSE_SUBTRACT};ft[d_]=n.MIN,ft[f_]=n.MAX;let rt={[p_]:n.ZERO,[m_]:n.ONE,[g_]:n.SRC_COLOR,[Tf]:n.SRC_ALPHA,[S_]:n.SRC_ALPHA_SATURATE,[y_]:n.DST_COLOR,[v_]:n.DST_ALPHA,[__]:n.ONE_MINUS_SRC_COLOR,[Ef]:n.ONE_MINUS_SRC_ALPHA,[b_]:n.ONE_MINUS_DST_COLOR,[x_]:n.ONE_MINUS_DST_ALPHA,[M_]:n.CONSTANT_COLOR,[w_]:n.ONE_MINUS_CONSTANT_COLOR,[T_]:n.CONSTANT_ALPHA,[E_]:n.ONE_MINUS_CONSTANT_ALPHA};function sn(k,re,ne,Te,_e,Se,qe,et,ce,ze){if(k===Vr){m===!0&&(Ye(n.BLEND),m=!1);return}if(m===!1&&(Me(n.BLEND),m=!0),k!==c_){if(k!==_||ze!==P){if((x!==Gr||R!==Gr)&&(n.blendEquation(n.FUNC_ADD),x=Gr,R=Gr),ze)switch(k){case Ko:n.blendFuncSeparate(n.ONE,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case Sf:n.blendFunc(n.ONE,n.ONE);break;case Mf:n.blendFuncSeparate(n.ZERO,n.ONE_MINUS_SRC_COLOR,n.ZERO,n.ONE);break;case wf:n.blendFuncSeparate(n.DST_COLOR,n.ONE_MINUS_SRC_ALPHA,n.ZERO,n.ONE);break;default:Qe("WebGLState: Invalid blending: ",k);break}else switch(k){case Ko:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case Sf:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE,n.ONE,n.ONE);break;case Mf:Qe("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case wf:Qe("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:Qe("WebGLState: Invalid blending: ",k);break}T=null,S=null,C=null,y=null,M.set(0,0,0),N=0,_=k,P=ze}return}_e=_e||re,Se=Se||ne,qe=qe||Te,(re!==x||_e!==R)&&(n.blendEquationSeparate(ft[re],ft[_e]),x=re,R=_e),(ne!==T||Te!==S||Se!==C||qe!==y)&&(n.blendFuncSeparate(rt[ne],rt[Te],rt[Se],rt[qe]),T=ne,S=Te,C=Se,y=qe),(et.equals(M)===!1||ce!==N)&&(n.blendColor(et.r,et.g,et.b,ce),M.copy(et),N=ce),_=k,P=!1}function Yt(k,re){k.side===xi?Ye(n.CULL_FACE):Me(n.CULL_FACE);let ne=k.side===pi;re&&(ne=!ne),yn(ne),k.blending===Ko&&k.transparent===!1?sn(Vr):sn(k.blending,k.blendEquation,k.blendSrc,k.blendDst,k.blendEquationAlpha,k.blendSrcAlpha,k.blendDstAlpha,k.blendColor,k.blendAlpha,k.premultipliedAlpha),o.setFunc(k.depthFunc),o.setTest(k.depthTest),o.setMask(k.depthWrite),r.setMask(k.colorWrite);let Te=k.stencilWrite;a.setTest(Te),Te&&(a.setMask(k.stencilWriteMask),a.setFunc(k.stencilFunc,k.stencilRef,k.stencilFuncMask),a.setOp(k.stencilFail,k.stencilZFail,k.stencilZPass)),Tt(k.polygonOffset,k.polygonOffsetFactor,k.polygonOffsetUnits),k.alphaToCoverage===!0?Me(n.SAMPLE_ALPHA_TO_COVERAGE):Ye(n.SAMPLE_ALPHA_TO_COVERAGE)}function yn(k){D!==k&&(k?n.frontFace(n.CW):n.frontFace(n.CCW),D=k)}function Vt(k){k!==o_?(Me(n.CULL_FACE),k!==z&&(k===bf?n.cullFace(n.BACK):k===a_?n.cullFace(n.FRONT):n.cullFace(n.FRONT_AND_BACK))):Ye(n.CULL_FACE),z=k}function Bn(k){k!==G&&(H&&n.lineWidth(k),G=k)}function Tt(k,re,ne){k?(Me(n.POLYGON_OFFSET_FILL),(U!==re||W!==ne)&&(U=re,W=ne,o.getReversed()&&(re=-re,ne=-ne),n.polygonOffset(re,ne))):Ye(n.POLYGON_OFFSET_FILL)}function In(k){k?Me(n.SCISSOR_TEST):Ye(n.SCISSOR_TEST)}function cn(k){k===void 0&&(k=n.TEXTURE0+$-1),Q!==k&&(n.activeTexture(k),Q=k)}function bn(k,re,ne){ne===void 0&&(Q===null?ne=n.TEXTURE0+$-1:ne=Q);let Te=ie[ne];Te===void 0&&(Te={type:void 0,texture:void 0},ie[ne]=Te),(Te.type!==k||Te.texture!==re)&&(Q!==ne&&(n.activeTexture(ne),Q=ne),n.bindTexture(k,re||Re[k]),Te.type=k,Te.texture=re)}function B(){let k=ie[Q];k!==void 0&&k.type!==void 0&&(n.bindTexture(k.type,null),k.type=void 0,k.texture=void 0)}function Ie(){try{n.compressedTexImage2D(...arguments)}catch(k){Qe("WebGLState:",k)}}function Ke(){try{n.compressedTexImage3D(...arguments)}catch(k){Qe("WebGLState:",k)}}function ct(){try{n.texSubImage2D(...arguments)}catch(k){Qe("WebGLState:",k)}}function we(){try{n.texSubImage3D(...arguments)}catch(k){Qe("WebGLState:",k)}}function Ht(){try{n.compressedTexSubImage2D(...arguments)}catch(k){Qe("WebGLState:",k)}}function He(){try{n.compressedTexSubImage3D(...arguments)}catch(k){Qe("WebGLState:",k)}}function Ze(){try{n.texStorage2D(...arguments)}catch(k){Qe("WebGLState:",k)}}function I(){try{n.texStorage3D(...arguments)}catch(k){Qe("WebGLState:",k)}}function w(){try{n.texImage2D(...arguments)}catch(k){Qe("WebGLState:",k)}}function q(){try{n.texImage3D(...arguments)}catch(k){Qe("WebGLState:",k)}}function ue(k){return f[k]!==void 0?f[k]:n.getParameter(k)}function oe(k,re){f[k]!==re&&(n.pixelStorei(k,re),f[k]=re)}function ve(k){ee.equals(k)===!1&&(n.scissor(k.x,k.y,k.z,k.w),ee.copy(k))}function ye(k){ge.equals(k)===!1&&(n.viewport(k.x,k.y,k.z,k.w),ge.copy(k))}function te(k,re){let ne=c.get(re);ne===void 0&&(ne=new WeakMap,c.set(re,ne));let Te=ne.get(k);Te===void 0&&(Te=n.getUniformBlockIndex(re,k.name),n.uniformBlockBinding(re,Te,Te),ne.set(k,Te))}function se(k,re,ne){let _e=c.get(re).get(k);l[_e]!==ne&&(n.bindBufferBase(n.UNIFORM_BUFFER,_e,ne),l[_e]=ne)}function pe(){n.disable(n.BLEND),n.disable(n.CULL_FACE),n.disable(n.DEPTH_TEST),n.disable(n.POLYGON_OFFSET_FILL),n.disable(n.SCISSOR_TEST),n.disable(n.STENCIL_TEST),n.disable(n.SAMPLE_ALPHA_TO_COVERAGE),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ZERO),n.blendFuncSeparate(n.ONE,n.ZERO,n.ONE,n.ZERO),n.blendColor(0,0,0,0),n.colorMask(!0,!0,!0,!0),n.clearColor(0,0,0,0),n.depthMask(!0),n.depthFunc(n.LESS),o.setReversed(!1),n.clearDepth(1),n.stencilMask(4294967295),n.stencilFunc(n.ALWAYS,0,4294967295),n.stencilOp(n.KEEP,n.KEEP,n.KEEP),n.clearStencil(0),n.cullFace(n.BACK),n.frontFace(n.CCW),n.polygonOffset(0,0),n.activeTexture(n.TEXTURE0),n.bindFramebuffer(n.FRAMEBUFFER,null),n.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),n.bindFramebuffer(n.READ_FRAMEBUFFER,null),n.useProgram(null),n.lineWidth(1),n.scissor(0,0,n.canvas.width,n.canvas.height),n.viewport(0,0,n.canvas.width,n.canvas.height),n.pixelStorei(n.PACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.BROWSER_DEFAULT_WEBGL),n.pixelStorei(n.PACK_ROW_LENGTH,0),n.pixelStorei(n.PACK_SKIP_PIXELS,0),n.pixelStorei(n.PACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_ROW_LENGTH,0),n.pixelStorei(n.UNPACK_IMAGE_HEIGHT,0),n.pixelStorei(n.UNPACK_SKIP_PIXELS,0),n.pixelStorei(n.UNPACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_SKIP_IMAGES,0),u={},f={},Q=null,ie={},d={},l={},p=new WeakMap,g=[],v=null,m=!1,_=null,x=null,T=null,S=null,R=null,C=null,y=null,M=new it(0,0,0),N=0,P=!1,D=null,z=null,G=null,U=null,W=null,ee.set(0,0,n.canvas.width,n.canvas.height),ge.set(0,0,n.canvas.width,n.canvas.height),r.reset(),o.reset(),a.reset()}return{buffers:{color:r,depth:o,stencil:a},enable:Me,disable:Ye,bindFramebuffer:lt,drawBuffers:We,useProgram:gt,setBlending:sn,setMaterial:Yt,setFlipSided:yn,setCullFace:Vt,setLineWidth:Bn,setPolygonOffset:Tt,setScissorTest:In,activeTexture:cn,bindTexture:bn,unbindTexture:B,compressedTexImage2D:Ie,compressedTexImage3D:Ke,texImage2D:w,texImage3D:q,pixelStorei:oe,getParameter:ue,updateUBOMapping:te,uniformBlockBinding:se,texStorage2D:Ze,texStorage3D:I,texSubImage2D:ct,texSubImage3D:we,compressedTexSubImage2D:Ht,compressedTexSubImage3D:He,scissor:ve,viewport:ye,reset:pe}}function ET(n,e,t,i,s,r,o){let a=e.has("WEBGL_multisampled_render_to_texture")?e.get("WEBGL_multisampled_render_to_texture"):null,l=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),c=new Xe,u=new WeakMap,f=new Set,d,p=new WeakMap,g=new Set,v=new FinalizationRegistry(I=>g.delete(I)),m=!1;try{m=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function _(I,w){return m?new OffscreenCanvas(I,w):Xa("canvas")}function x(I,w,q){let ue=1,oe=Ze(I);if((oe.width>q||oe.height>q)&&(ue=q/Math.max(oe.width,oe.height)),ue<1)if(typeof HTMLImageElement<"u"&&I instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&I instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&I instanceof ImageBitmap||typeof VideoFrame<"u"&&I instanceof VideoFrame){let ve=Math.floor(ue*oe.width),ye=Math.floor(ue*oe.height);d===void 0&&(d=_(ve,ye));let te=w?_(ve,ye):d;return te.width=ve,te.height=ye,te.getContext("2d").drawImage(I,0,0,ve,ye),Je("WebGLRenderer: Texture has been resized from ("+oe.width+"x"+oe.height+") to ("+ve+"x"+ye+")."),te}else return"data"in I&&Je("WebGLRenderer: Image in DataTexture is too big ("+oe.width+"x"+oe.height+")."),I;return I}function T(I){return I.generateMipmaps}function S(I){n.generateMipmap(I)}function R(I){return I.isWebGLCubeRenderTarget?n.TEXTURE_CUBE_MAP:I.isWebGL3DRenderTarget?n.TEXTURE_3D:I.isWebGLArrayRenderTarget||I.isCompressedArrayTexture?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D}function C(I,w,q,ue,oe,ve=!1){if(I!==null){if(n[I]!==void 0)return n[I];Je("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+I+"'")}let ye;ue&&(ye=e.get("EXT_texture_norm16"),ye||Je("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let te=w;if(w===n.RED&&(q===n.FLOAT&&(te=n.R32F),q===n.HALF_FLOAT&&(te=n.R16F),q===n.UNSIGNED_BYTE&&(te=n.R8),q===n.UNSIGNED_SHORT&&ye&&(te=ye.R16_EXT),q===n.SHORT&&ye&&(te=ye.R16_SNORM_EXT)),w===n.RED_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.R8UI),q===n.UNSIGNED_SHORT&&(te=n.R16UI),q===n.UNSIGNED_INT&&(te=n.R32UI),q===n.BYTE&&(te=n.R8I),q===n.SHORT&&(te=n.R16I),q===n.INT&&(te=n.R32I)),w===n.RG&&(q===n.FLOAT&&(te=n.RG32F),q===n.HALF_FLOAT&&(te=n.RG16F),q===n.UNSIGNED_BYTE&&(te=n.RG8),q===n.UNSIGNED_SHORT&&ye&&(te=ye.RG16_EXT),q===n.SHORT&&ye&&(te=ye.RG16_SNORM_EXT)),w===n.RG_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RG8UI),q===n.UNSIGNED_SHORT&&(te=n.RG16UI),q===n.UNSIGNED_INT&&(te=n.RG32UI),q===n.BYTE&&(te=n.RG8I),q===n.SHORT&&(te=n.RG16I),q===n.INT&&(te=n.RG32I)),w===n.RGB_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RGB8UI),q===n.UNSIGNED_SHORT&&(te=n.RGB16UI),q===n.UNSIGNED_INT&&(te=n.RGB32UI),q===n.BYTE&&(te=n.RGB8I),q===n.SHORT&&(te=n.RGB16I),q===n.INT&&(te=n.RGB32I)),w===n.RGBA_INTEGER&&(q===n.UNSIGNED_BYTE&&(te=n.RGBA8UI),q===n.UNSIGNED_SHORT&&(te=n.RGBA16UI),q===n.UNSIGNED_INT&&(te=n.RGBA32UI),q===n.BYTE&&(te=n.RGBA8I),q===n.SHORT&&(te=n.RGBA16I),q===n.INT&&(te=n.RGBA32I)),w===n.RGB&&(q===n.UNSIGNED_SHORT&&ye&&(te=ye.RGB16_EXT),q===n.SHORT&&ye&&(te=ye.RGB16_SNORM_EXT),q===n.UNSIGNED_INT_5_9_9_9_REV&&(te=n.RGB9_E5),q===n.UNSIGNED_INT_10F_11F_11F_REV&&(te=n.R11F_G11F_B10F)),w===n.RGBA){let se=ve?Wa:St.getTransfer(oe);q===n.FLOAT&&(te=n.RGBA32F),q===n.HALF_FLOAT&&(te=n.RGBA16F),q===n.UNSIGNED_BYTE&&(te=se===Dt?n.SRGB8_ALPHA8:n.RGBA8),q===n.UNSIGNED_SHORT&&ye&&(te=ye.RGBA16_EXT),q===n.SHORT&&ye&&(te=ye.RGBA16_SNORM_EXT),q===n.UNSIGNED_SHORT_4_4_4_4&&(te=n.RGBA4),q===n.UNSIGNED_SHORT_5_5_5_1&&(te=n.RGB5_A1)}return(te===n.R16F||te===n.R32F||te===n.RG16F||te===n.RG32F||te===n.RGBA16F||te===n.RGBA32F)&&e.get("EXT_color_buffer_float"),te}function y(I,w){let q;return I?w===null||w===ss||w===Wr?q=n.DEPTH24_STENCIL8:w===rs?q=n.DEPTH32F_STENCIL8:w===Qo&&(q=n.DEPTH24_STENCIL8,Je("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):w===null||w===ss||w===Wr?q=n.DEPTH_COMPONENT24:w===rs?q=n.DEPTH_COMPONENT32F:w===Qo&&(q=n.DEPTH_COMPONENT16),q}function M(I,w){return T(I)===!0||I.isFramebufferTexture&&I.minFilter!==qn&&I.minFilter!==di?Math.log2(Math.max(w.width,w.height))+1:I.mipmaps.length>0?I.mipmaps.length:I.isCompressedTexture&&Array.isArray(I.image)?w.mipmaps.length:1}function N(I){let w=new WeakRef(I);i.get(I).__ref=w,g.add(w),v.register(I,w,w)}function P(I){let w=i.get(I).__ref;w!==void 0&&(g.delete(w),v.unregister(w))}function D(I){G(I.target)}function z(I){U(I.target)}function G(I){I.removeEventListener("dispose",D),P(I),$(I),I.isVideoTexture&&u.delete(I),I.isHTMLTexture&&f.delete(I)}function U(I){I.removeEventListener("dispose",z),P(I),le(I)}function W(){for(let I of g){let w=I.deref();w!==void 0&&(w.isRenderTarget===!0?U(w):G(w))}g.clear(),f.clear()}function $(I){let w=i.get(I);if(w.__webglInit===void 0)return;let q=I.source,ue=p.get(q);if(ue){let oe=ue[w.__cacheKey];oe.usedTimes--,oe.usedTimes===0&&H(I),Object.keys(ue).length===0&&p.delete(q)}i.remove(I)}function H(I){let w=i.get(I);n.deleteTexture(w.__webglTexture);let q=I.source,ue=p.get(q);delete ue[w.__cacheKey],o.memory.textures--}function le(I){let w=i.get(I);w.__depthDisposeCallback&&w.__depthDisposeCallback();let q=I.depthTexture;if(q&&q.renderTarget===I&&G(q),I.isWebGLCubeRenderTarget)for(let oe=0;oe<6;oe++){if(Array.isArray(w.__webglFramebuffer[oe]))for(let ve=0;ve<w.__webglFramebuffer[oe].length;ve++)n.deleteFramebuffer(w.__webglFramebuffer[oe][ve]);else n.deleteFramebuffer(w.__webglFramebuffer[oe]);w.__webglDepthbuffer&&n.deleteRenderbuffer(w.__webglDepthbuffer[oe])}else{if(Array.isArray(w.__webglFramebuffer))for(let oe=0;oe<w.__webglFramebuffer.length;oe++)n.deleteFramebuffer(w.__webglFramebuffer[oe]);else n.deleteFramebuffer(w.__webglFramebuffer);if(w.__webglDepthbuffer&&n.deleteRenderbuffer(w.__webglDepthbuffer),w.__webglMultisampledFramebuffer&&n.deleteFramebuffer(w.__webglMultisampledFramebuffer),w.__webglColorRenderbuffer)for(let oe=0;oe<w.__webglColorRenderbuffer.length;oe++)w.__webglColorRenderbuffer[oe]&&n.deleteRenderbuffer(w.__webglColorRenderbuffer[oe]);w.__webglDepthRenderbuffer&&n.deleteRenderbuffer(w.__webglDepthRenderbuffer)}let ue=I.textures;for(let oe=0,ve=ue.length;oe<ve;oe++){let ye=i.get(ue[oe]);ye.__webglTexture&&(n.deleteTexture(ye.__webglTexture),o.memory.textures--),i.remove(ue[oe])}i.remove(I)}let Y=0;function Q(){Y=0}function ie(){return Y}function he(I){Y=I}function de(){let I=Y;return I>=s.maxTextures&&Je("WebGLTextures: Trying to use "+(I+1)+" texture units while this GPU supports only "+s.maxTextures),Y+=1,I}function ee(I){let w=[];return w.push(I.wrapS),w.push(I.wrapT),w.push(I.wrapR||0),w.push(I.magFilter),w.push(I.minFilter),w.push(I.anisotropy),w.push(I.internalFormat),w.push(I.format),w.push(I.type),w.push(I.generateMipmaps),w.push(I.mipmapsAutoUpdate),w.push(I.premultiplyAlpha),w.push(I.flipY),w.push(I.unpackAlignment),w.push(I.colorSpace),w.join()}function ge(I,w){let q=i.get(I);if(I.isVideoTexture&&Ht(I),I.isRenderTargetTexture===!1&&I.isExternalTexture!==!0&&I.version>0&&q.__version!==I.version){let ue=I.image;if(ue===null)Je("WebGLRenderer: Texture marked for update but no image data found.");else if(ue.complete===!1)Je("WebGLRenderer: Texture marked for update but image is incomplete");else{Yt(q,I,w);return}}else I.isExternalTexture&&(q.__webglTexture=I.sourceTexture?I.sourceTexture:null);t.bindTexture(n.TEXTURE_2D,q.__webglTexture,n.TEXTURE0+w)}function xe(I,w){let q=i.get(I);if(I.isRenderTargetTexture===!1&&I.version>0&&q.__version!==I.version){Yt(q,I,w);return}else I.isExternalTexture&&(q.__webglTexture=I.sourceTexture?I.sourceTexture:null);t.bindTexture(n.TEXTURE_2D_ARRAY,q.__webglTexture,n.TEXTURE0+w)}function Re(I,w){let q=i.get(I);if(I.isRenderTargetTexture===!1&&I.version>0&&q.__version!==I.version){Yt(q,I,w);return}t.bindTexture(n.TEXTURE_3D,q.__webglTexture,n.TEXTURE0+w)}function Me(I,w){let q=i.get(I);if(I.version>0&&q.__version!==I.version){yn(q,I,w);return}t.bindTexture(n.TEXTURE_CUBE_MAP,q.__webglTexture,n.TEXTURE0+w)}let Ye={[Jc]:n.REPEAT,[bs]:n.CLAMP_TO_EDGE,[Kc]:n.MIRRORED_REPEAT},lt={[qn]:n.NEAREST,[R_]:n.NEAREST_MIPMAP_NEAREST,[_l]:n.NEAREST_MIPMAP_LINEAR,[di]:n.LINEAR,[wu]:n.LINEAR_MIPMAP_NEAREST,[Xs]:n.LINEAR_MIPMAP_LINEAR},We={[D_]:n.NEVER,[Xf]:n.ALWAYS,[N_]:n.LESS,[Hf]:n.LEQUAL,[U_]:n.EQUAL,[Wf]:n.GEQUAL,[O_]:n.GREATER,[F_]:n.NOTEQUAL};function gt(I,w){if(w.type===rs&&e.has("OES_texture_float_linear")===!1&&(w.magFilter===di||w.magFilter===wu||w.magFilter===_l||w.magFilter===Xs||w.minFilter===di||w.minFilter===wu||w.minFilter===_l||w.minFilter===Xs)&&Je("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),n.texParameteri(I,n.TEXTURE_WRAP_S,Ye[w.wrapS]),n.texParameteri(I,n.TEXTURE_WRAP_T,Ye[w.wrapT]),(I===n.TEXTURE_3D||I===n.TEXTURE_2D_ARRAY)&&n.texParameteri(I,n.TEXTURE_WRAP_R,Ye[w.wrapR]),n.texParameteri(I,n.TEXTURE_MAG_FILTER,lt[w.magFilter]),n.texParameteri(I,n.TEXTURE_MIN_FILTER,lt[w.minFilter]),w.compareFunction&&(n.texParameteri(I,n.TEXTURE_COMPARE_MODE,n.COMPARE_REF_TO_TEXTURE),n.texParameteri(I,n.TEXTURE_COMPARE_FUNC,We[w.compareFunction])),e.has("EXT_texture_filter_anisotropic")===!0){if(w.magFilter===qn||w.minFilter!==_l&&w.minFilter!==Xs||w.type===rs&&e.has("OES_texture_float_linear")===!1)return;if(w.anisotropy>1||i.get(w).__currentAnisotropy){let q=e.get("EXT_texture_filter_anisotropic");n.texParameterf(I,q.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(w.anisotropy,s.getMaxAnisotropy())),i.get(w).__currentAnisotropy=w.anisotropy}}}function ft(I,w){let q=!1;I.__webglInit===void 0&&(I.__webglInit=!0,w.addEventListener("dispose",D),N(w));let ue=w.source,oe=p.get(ue);oe===void 0&&(oe={},p.set(ue,oe));let ve=ee(w);if(ve!==I.__cacheKey){oe[ve]===void 0&&(oe[ve]={texture:n.createTexture(),usedTimes:0},o.memory.textures++,q=!0),oe[ve].usedTimes++;let ye=oe[I.__cacheKey];ye!==void 0&&(oe[I.__cacheKey].usedTimes--,ye.usedTimes===0&&H(w)),I.__cacheKey=ve,I.__webglTexture=oe[ve].texture}return q}function rt(I,w,q){return Math.floor(Math.floor(I/q)/w)}function sn(I,w,q,ue){let ve=I.updateRanges;if(ve.length===0)t.texSubImage2D(n.TEXTURE_2D,0,0,0,w.width,w.height,q,ue,w.data);else{ve.sort((k,re)=>k.start-re.start);let ye=0;for(let k=1;k<ve.length;k++){let re=ve[ye],ne=ve[k],Te=re.start+re.count,_e=rt(ne.start,w.width,4),Se=rt(re.start,w.width,4);ne.start<=Te+1&&_e===Se&&rt(ne.start+ne.count-1,w.width,4)===_e?re.count=Math.max(re.count,ne.start+ne.count-re.start):(++ye,ve[ye]=ne)}ve.length=ye+1;let te=t.getParameter(n.UNPACK_ROW_LENGTH),se=t.getParameter(n.UNPACK_SKIP_PIXELS),pe=t.getParameter(n.UNPACK_SKIP_ROWS);t.pixelStorei(n.UNPACK_ROW_LENGTH,w.width);for(let k=0,re=ve.length;k<re;k++){let ne=ve[k],Te=Math.floor(ne.start/4),_e=Math.ceil(ne.count/4),Se=Te%w.width,qe=Math.floor(Te/w.width),et=_e,ce=1;t.pixelStorei(n.UNPACK_SKIP_PIXELS,Se),t.pixelStorei(n.UNPACK_SKIP_ROWS,qe),t.texSubImage2D(n.TEXTURE_2D,0,Se,qe,et,ce,q,ue,w.data)}I.clearUpdateRanges(),t.pixelStorei(n.UNPACK_ROW_LENGTH,te),t.pixelStorei(n.UNPACK_SKIP_PIXELS,se),t.pixelStorei(n.UNPACK_SKIP_ROWS,pe)}}function Yt(I,w,q){let ue=n.TEXTURE_2D;(w.isDataArrayTexture||w.isCompressedArrayTexture)&&(ue=n.TEXTURE_2D_ARRAY),w.isData3DTexture&&(ue=n.TEXTURE_3D);let oe=ft(I,w),ve=w.source;t.bindTexture(ue,I.__webglTexture,n.TEXTURE0+q);let ye=i.get(ve);if(ve.version!==ye.__version||oe===!0){if(t.activeTexture(n.TEXTURE0+q),(typeof ImageBitmap<"u"&&w.image instanceof ImageBitmap)===!1){let ce=St.getPrimaries(St.workingColorSpace),ze=w.colorSpace===Ys?null:St.getPrimaries(w.colorSpace),tt=w.colorSpace===Ys||ce===ze?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,w.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,w.premultiplyAlpha),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,tt)}t.pixelStorei(n.UNPACK_ALIGNMENT,w.unpackAlignment);let se=x(w.image,!1,s.maxTextureSize);se=He(w,se);let pe=r.convert(w.format,w.colorSpace),k=r.convert(w.type),re=C(w.internalFormat,pe,k,w.normalized,w.colorSpace,w.isVideoTexture);gt(ue,w);let ne,Te=w.mipmaps,_e=w.isVideoTexture!==!0,Se=ye.__version===void 0||oe===!0,qe=ve.dataReady,et=M(w,se);if(w.isDepthTexture)re=y(w.format===qs,w.type),Se&&(_e?t.texStorage2D(n.TEXTURE_2D,1,re,se.width,se.height):t.texImage2D(n.TEXTURE_2D,0,re,se.width,se.height,0,pe,k,null));else if(w.isDataTexture)if(Te.length>0){_e&&Se&&t.texStorage2D(n.TEXTURE_2D,et,re,Te[0].width,Te[0].height);for(let ce=0,ze=Te.length;ce<ze;ce++)ne=Te[ce],_e?qe&&t.texSubImage2D(n.TEXTURE_2D,ce,0,0,ne.width,ne.height,pe,k,ne.data):t.texImage2D(n.TEXTURE_2D,ce,re,ne.width,ne.height,0,pe,k,ne.data);w.generateMipmaps=!1}else _e?(Se&&t.texStorage2D(n.TEXTURE_2D,et,re,se.width,se.height),qe&&sn(w,se,pe,k)):t.texImage2D(n.TEXTURE_2D,0,re,se.width,se.height,0,pe,k,se.data);else if(w.isCompressedTexture)if(w.isCompressedArrayTexture){_e&&Se&&t.texStorage3D(n.TEXTURE_2D_ARRAY,et,re,Te[0].width,Te[0].height,se.depth);for(let ce=0,ze=Te.length;ce<ze;ce++)if(ne=Te[ce],w.format!==as)if(pe!==null)if(_e){if(qe)if(w.layerUpdates.size>0){let tt=tp(ne.width,ne.height,w.format,w.type);for(let Pe of w.layerUpdates){let dt=ne.data.subarray(Pe*tt/ne.data.BYTES_PER_ELEMENT,(Pe+1)*tt/ne.data.BYTES_PER_ELEMENT);t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,ce,0,0,Pe,ne.width,ne.height,1,pe,dt)}}else t.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,ce,0,0,0,ne.width,ne.height,se.depth,pe,ne.data)}else t.compressedTexImage3D(n.TEXTURE_2D_ARRAY,ce,re,ne.width,ne.height,se.depth,0,ne.data,0,0);else Je("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else _e?qe&&t.texSubImage3D(n.TEXTURE_2D_ARRAY,ce,0,0,0,ne.width,ne.height,se.depth,pe,k,ne.data):t.texImage3D(n.TEXTURE_2D_ARRAY,ce,re,ne.width,ne.height,se.depth,0,pe,k,ne.data);w.layerUpdates.size>0&&w.clearLayerUpdates()}else{_e&&Se&&t.texStorage2D(n.TEXTURE_2D,et,re,Te[0].width,Te[0].height);for(let ce=0,ze=Te.length;ce<ze;ce++)ne=Te[ce],w.format!==as?pe!==null?_e?qe&&t.compressedTexSubImage2D(n.TEXTURE_2D,ce,0,0,ne.width,ne.height,pe,ne.data):t.compressedTexImage2D(n.TEXTURE_2D,ce,re,ne.width,ne.height,0,ne.data):Je("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):_e?qe&&t.texSubImage2D(n.TEXTURE_2D,ce,0,0,ne.width,ne.height,pe,k,ne.data):t.texImage2D(n.TEXTURE_2D,ce,re,ne.width,ne.height,0,pe,k,ne.data)}else if(w.isDataArrayTexture)if(_e){if(Se&&t.texStorage3D(n.TEXTURE_2D_ARRAY,et,re,se.width,se.height,se.depth),qe)if(w.layerUpdates.size>0){let ce=tp(se.width,se.height,w.format,w.type);for(let ze of w.layerUpdates){let tt=se.data.subarray(ze*ce/se.data.BYTES_PER_ELEMENT,(ze+1)*ce/se.data.BYTES_PER_ELEMENT);t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,ze,se.width,se.height,1,pe,k,tt)}w.clearLayerUpdates()}else t.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,0,se.width,se.height,se.depth,pe,k,se.data)}else t.texImage3D(n.TEXTURE_2D_ARRAY,0,re,se.width,se.height,se.depth,0,pe,k,se.data);else if(w.isData3DTexture)_e?(Se&&t.texStorage3D(n.TEXTURE_3D,et,re,se.width,se.height,se.depth),qe&&t.texSubImage3D(n.TEXTURE_3D,0,0,0,0,se.width,se.height,se.depth,pe,k,se.data)):t.texImage3D(n.TEXTURE_3D,0,re,se.width,se.height,se.depth,0,pe,k,se.data);else if(w.isFramebufferTexture){if(Se)if(_e)t.texStorage2D(n.TEXTURE_2D,et,re,se.width,se.height);else{let ce=se.width,ze=se.height;for(let tt=0;tt<et;tt++)t.texImage2D(n.TEXTURE_2D,tt,re,ce,ze,0,pe,k,null),ce>>=1,ze>>=1}}else if(w.isHTMLTexture){if("texElementImage2D"in n){let ce=n.canvas;if(ce.hasAttribute("layoutsubtree")||ce.setAttribute("layoutsubtree","true"),se.parentNode!==ce){ce.appendChild(se),f.add(w),ce.onpaint=ze=>{let tt=ze.changedElements;for(let Pe of f)tt.includes(Pe.image)&&(Pe.needsUpdate=!0)},ce.requestPaint();return}if(n.texElementImage2D.length===3)n.texElementImage2D(n.TEXTURE_2D,n.RGBA8,se);else{let tt=n.RGBA,Pe=n.RGBA,dt=n.UNSIGNED_BYTE;n.texElementImage2D(n.TEXTURE_2D,0,tt,Pe,dt,se)}n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,n.LINEAR),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE)}}else if(Te.length>0){if(_e&&Se){let ce=Ze(Te[0]);t.texStorage2D(n.TEXTURE_2D,et,re,ce.width,ce.height)}for(let ce=0,ze=Te.length;ce<ze;ce++)ne=Te[ce],_e?qe&&t.texSubImage2D(n.TEXTURE_2D,ce,0,0,pe,k,ne):t.texImage2D(n.TEXTURE_2D,ce,re,pe,k,ne);w.generateMipmaps=!1}else if(_e){if(Se){let ce=Ze(se);t.texStorage2D(n.TEXTURE_2D,et,re,ce.width,ce.height)}qe&&t.texSubImage2D(n.TEXTURE_2D,0,0,0,pe,k,se)}else t.texImage2D(n.TEXTURE_2D,0,re,pe,k,se);T(w)&&w.mipmapsAutoUpdate===!0&&S(ue),ye.__version=ve.version,w.onUpdate&&w.onUpdate(w)}I.__version=w.version}function yn(I,w,q){if(w.image.length!==6)return;let ue=ft(I,w),oe=w.source;t.bindTexture(n.TEXTURE_CUBE_MAP,I.__webglTexture,n.TEXTURE0+q);let ve=i.get(oe);if(oe.version!==ve.__version||ue===!0){t.activeTexture(n.TEXTURE0+q);let ye=St.getPrimaries(St.workingColorSpace),te=w.colorSpace===Ys?null:St.getPrimaries(w.colorSpace),se=w.colorSpace===Ys||ye===te?n.NONE:n.BROWSER_DEFAULT_WEBGL;t.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,w.flipY),t.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,w.premultiplyAlpha),t.pixelStorei(n.UNPACK_ALIGNMENT,w.unpackAlignment),t.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,se);let pe=w.isCompressedTexture||w.image[0].isCompressedTexture,k=w.image[0]&&w.image[0].isDataTexture,re=[];for(let Pe=0;Pe<6;Pe++)!pe&&!k?re[Pe]=x(w.image[Pe],!0,s.maxCubemapSize):re[Pe]=k?w.image[Pe].image:w.image[Pe],re[Pe]=He(w,re[Pe]);let ne=re[0],Te=r.convert(w.format,w.colorSpace),_e=r.convert(w.type),Se=C(w.internalFormat,Te,_e,w.normalized,w.colorSpace),qe=w.isVideoTexture!==!0,et=ve.__version===void 0||ue===!0,ce=oe.dataReady,ze=M(w,ne);gt(n.TEXTURE_CUBE_MAP,w);let tt;if(w.isDepthTexture){if(Se=y(w.format===qs,w.type),et)if(qe)t.texStorage2D(n.TEXTURE_CUBE_MAP,1,Se,ne.width,ne.height);else for(let Pe=0;Pe<6;Pe++)t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,0,Se,ne.width,ne.height,0,Te,_e,null)}else if(pe){qe&&et&&t.texStorage2D(n.TEXTURE_CUBE_MAP,ze,Se,ne.width,ne.height);for(let Pe=0;Pe<6;Pe++){tt=re[Pe].mipmaps;for(let dt=0;dt<tt.length;dt++){let Zt=tt[dt];w.format!==as?Te!==null?qe?ce&&t.compressedTexSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt,0,0,Zt.width,Zt.height,Te,Zt.data):t.compressedTexImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt,Se,Zt.width,Zt.height,0,Zt.data):Je("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):qe?ce&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt,0,0,Zt.width,Zt.height,Te,_e,Zt.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt,Se,Zt.width,Zt.height,0,Te,_e,Zt.data)}}}else{if(tt=w.mipmaps,qe&&et){tt.length>0&&ze++;let Pe=Ze(re[0]);t.texStorage2D(n.TEXTURE_CUBE_MAP,ze,Se,Pe.width,Pe.height)}for(let Pe=0;Pe<6;Pe++)if(k){qe?ce&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,0,0,0,re[Pe].width,re[Pe].height,Te,_e,re[Pe].data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,0,Se,re[Pe].width,re[Pe].height,0,Te,_e,re[Pe].data);for(let dt=0;dt<tt.length;dt++){let ii=tt[dt].image[Pe].image;qe?ce&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt+1,0,0,ii.width,ii.height,Te,_e,ii.data):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt+1,Se,ii.width,ii.height,0,Te,_e,ii.data)}}else{qe?ce&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,0,0,0,Te,_e,re[Pe]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,0,Se,Te,_e,re[Pe]);for(let dt=0;dt<tt.length;dt++){let Zt=tt[dt];qe?ce&&t.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt+1,0,0,Te,_e,Zt.image[Pe]):t.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+Pe,dt+1,Se,Te,_e,Zt.image[Pe])}}}T(w)&&w.mipmapsAutoUpdate===!0&&S(n.TEXTURE_CUBE_MAP),ve.__version=oe.version,w.onUpdate&&w.onUpdate(w)}I.__version=w.version}function Vt(I,w,q,ue,oe,ve){let ye=r.convert(q.format,q.colorSpace),te=r.convert(q.type),se=C(q.internalFormat,ye,te,q.normalized,q.colorSpace),pe=i.get(w),k=i.get(q);if(k.__renderTarget=w,!pe.__hasExternalTextures){let re=Math.max(1,w.width>>ve),ne=Math.max(1,w.height>>ve);oe===n.TEXTURE_3D||oe===n.TEXTURE_2D_ARRAY?t.texImage3D(oe,ve,se,re,ne,w.depth,0,ye,te,null):t.texImage2D(oe,ve,se,re,ne,0,ye,te,null)}t.bindFramebuffer(n.FRAMEBUFFER,I),we(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,ue,oe,k.__webglTexture,0,ct(w)):(oe===n.TEXTURE_2D||oe>=n.TEXTURE_CUBE_MAP_POSITIVE_X&&oe<=n.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&n.framebufferTexture2D(n.FRAMEBUFFER,ue,oe,k.__webglTexture,ve),t.bindFramebuffer(n.FRAMEBUFFER,null)}function Bn(I,w,q){if(n.bindRenderbuffer(n.RENDERBUFFER,I),w.depthBuffer){let ue=w.depthTexture,oe=ue&&ue.isDepthTexture?ue.type:null,ve=y(w.stencilBuffer,oe),ye=w.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;we(w)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,ct(w),ve,w.width,w.height):q?n.renderbufferStorageMultisample(n.RENDERBUFFER,ct(w),ve,w.width,w.height):n.renderbufferStorage(n.RENDERBUFFER,ve,w.width,w.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,ye,n.RENDERBUFFER,I)}else{let ue=w.textures;for(let oe=0;oe<ue.length;oe++){let ve=ue[oe],ye=r.convert(ve.format,ve.colorSpace),te=r.convert(ve.type),se=C(ve.internalFormat,ye,te,ve.normalized,ve.colorSpace);we(w)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,ct(w),se,w.width,w.height):q?n.renderbufferStorageMultisample(n.RENDERBUFFER,ct(w),se,w.width,w.height):n.renderbufferStorage(n.RENDERBUFFER,se,w.width,w.height)}}n.bindRenderbuffer(n.RENDERBUFFER,null)}function Tt(I,w,q){let ue=w.isWebGLCubeRenderTarget===!0;if(t.bindFramebuffer(n.FRAMEBUFFER,I),!(w.depthTexture&&w.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");let oe=i.get(w.depthTexture);oe.__renderTarget=w;let ve=ue?w.depthTexture.image[0]:w.depthTexture.image;(!oe.__webglTexture||ve.width!==w.width||ve.height!==w.height)&&(ve.width=w.width,ve.height=w.height,w.depthTexture.needsUpdate=!0),ue?Me(w.depthTexture,0):ge(w.depthTexture,0);let ye=oe.__webglTexture,te=ct(w),se=ue?n.TEXTURE_CUBE_MAP_POSITIVE_X+q:n.TEXTURE_2D,pe=w.depthTexture.format===qs?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;if(w.depthTexture.format===Vs)we(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,pe,se,ye,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,pe,se,ye,0);else if(w.depthTexture.format===qs)we(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,pe,se,ye,0,te):n.framebufferTexture2D(n.FRAMEBUFFER,pe,se,ye,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function In(I){let w=i.get(I),q=I.isWebGLCubeRenderTarget===!0;if(w.__boundDepthTexture!==I.depthTexture){let ue=I.depthTexture;if(w.__depthDisposeCallback&&w.__depthDisposeCallback(),ue){let oe=()=>{delete w.__boundDepthTexture,delete w.__depthDisposeCallback,ue.removeEventListener("dispose",oe)};ue.addEventListener("dispose",oe),w.__depthDisposeCallback=oe}w.__boundDepthTexture=ue}if(I.depthTexture&&!w.__autoAllocateDepthBuffer)if(q)for(let ue=0;ue<6;ue++)Tt(w.__webglFramebuffer[ue],I,ue);else I.texture.mipmaps.length>0?Tt(w.__webglFramebuffer[0],I,0):Tt(w.__webglFramebuffer,I,0);else if(q){w.__webglDepthbuffer=[];for(let ue=0;ue<6;ue++)if(t.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer[ue]),w.__webglDepthbuffer[ue]===void 0)w.__webglDepthbuffer[ue]=n.createRenderbuffer(),Bn(w.__webglDepthbuffer[ue],I,!1);else{let oe=I.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ve=w.__webglDepthbuffer[ue];n.bindRenderbuffer(n.RENDERBUFFER,ve),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,ve)}}else if(I.texture.mipmaps.length>0?t.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer[0]):t.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer),w.__webglDepthbuffer===void 0)w.__webglDepthbuffer=n.createRenderbuffer(),Bn(w.__webglDepthbuffer,I,!1);else{let oe=I.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ve=w.__webglDepthbuffer;n.bindRenderbuffer(n.RENDERBUFFER,ve),n.framebufferRenderbuffer(n.FRAMEBUFFER,oe,n.RENDERBUFFER,ve)}t.bindFramebuffer(n.FRAMEBUFFER,null)}function cn(I,w,q){let ue=i.get(I);w!==void 0&&Vt(ue.__webglFramebuffer,I,I.texture,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,0),q!==void 0&&In(I)}function bn(I){let w=I.texture,q=i.get(I),ue=i.get(w);I.addEventListener("dispose",z),N(I);let oe=I.textures,ve=I.isWebGLCubeRenderTarget===!0,ye=oe.length>1;if(ye||(ue.__webglTexture===void 0&&(ue.__webglTexture=n.createTexture()),ue.__version=w.version,o.memory.textures++),ve){q.__webglFramebuffer=[];for(let te=0;te<6;te++)if(w.mipmaps.length>0){q.__webglFramebuffer[te]=[];for(let se=0;se<w.mipmaps.length;se++)q.__webglFramebuffer[te][se]=n.createFramebuffer()}else q.__webglFramebuffer[te]=n.createFramebuffer()}else{if(w.mipmaps.length>0){q.__webglFramebuffer=[];for(let te=0;te<w.mipmaps.length;te++)q.__webglFramebuffer[te]=n.createFramebuffer()}else q.__webglFramebuffer=n.createFramebuffer();if(ye)for(let te=0,se=oe.length;te<se;te++){let pe=i.get(oe[te]);pe.__webglTexture===void 0&&(pe.__webglTexture=n.createTexture(),o.memory.textures++)}if(I.samples>0&&we(I)===!1){q.__webglMultisampledFramebuffer=n.createFramebuffer(),q.__webglColorRenderbuffer=[],t.bindFramebuffer(n.FRAMEBUFFER,q.__webglMultisampledFramebuffer);for(let te=0;te<oe.length;te++){let se=oe[te];q.__webglColorRenderbuffer[te]=n.createRenderbuffer(),n.bindRenderbuffer(n.RENDERBUFFER,q.__webglColorRenderbuffer[te]);let pe=r.convert(se.format,se.colorSpace),k=r.convert(se.type),re=C(se.internalFormat,pe,k,se.normalized,se.colorSpace,I.isXRRenderTarget===!0),ne=ct(I);n.renderbufferStorageMultisample(n.RENDERBUFFER,ne,re,I.width,I.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+te,n.RENDERBUFFER,q.__webglColorRenderbuffer[te])}n.bindRenderbuffer(n.RENDERBUFFER,null),I.depthBuffer&&(q.__webglDepthRenderbuffer=n.createRenderbuffer(),Bn(q.__webglDepthRenderbuffer,I,!0)),t.bindFramebuffer(n.FRAMEBUFFER,null)}}if(ve){t.bindTexture(n.TEXTURE_CUBE_MAP,ue.__webglTexture),gt(n.TEXTURE_CUBE_MAP,w);for(let te=0;te<6;te++)if(w.mipmaps.length>0)for(let se=0;se<w.mipmaps.length;se++)Vt(q.__webglFramebuffer[te][se],I,w,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,se);else Vt(q.__webglFramebuffer[te],I,w,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+te,0);T(w)?S(n.TEXTURE_CUBE_MAP):w.mipmaps.length>0&&n.texParameteri(n.TEXTURE_CUBE_MAP,n.TEXTURE_MAX_LEVEL,w.mipmaps.length-1),t.unbindTexture()}else if(ye){for(let te=0,se=oe.length;te<se;te++){let pe=oe[te],k=i.get(pe),re=n.TEXTURE_2D;(I.isWebGL3DRenderTarget||I.isWebGLArrayRenderTarget)&&(re=I.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(re,k.__webglTexture),gt(re,pe),Vt(q.__webglFramebuffer,I,pe,n.COLOR_ATTACHMENT0+te,re,0),T(pe)&&S(re)}t.unbindTexture()}else{let te=n.TEXTURE_2D;if((I.isWebGL3DRenderTarget||I.isWebGLArrayRenderTarget)&&(te=I.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),t.bindTexture(te,ue.__webglTexture),gt(te,w),w.mipmaps.length>0)for(let se=0;se<w.mipmaps.length;se++)Vt(q.__webglFramebuffer[se],I,w,n.COLOR_ATTACHMENT0,te,se);else Vt(q.__webglFramebuffer,I,w,n.COLOR_ATTACHMENT0,te,0);T(w)?S(te):w.mipmaps.length>0&&n.texParameteri(te,n.TEXTURE_MAX_LEVEL,w.mipmaps.length-1),t.unbindTexture()}I.depthBuffer&&In(I)}function B(I){let w=I.textures;for(let q=0,ue=w.length;q<ue;q++){let oe=w[q];if(T(oe)&&oe.mipmapsAutoUpdate===!0){let ve=R(I),ye=i.get(oe).__webglTexture;t.bindTexture(ve,ye),S(ve),t.unbindTexture()}}}let Ie=[];function Ke(I){if(I.samples>0){if(we(I)===!1){let w=I.textures,q=I.width,ue=I.height,oe=n.COLOR_BUFFER_BIT,ve=I.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ye=i.get(I),te=w.length>1;if(te)for(let pe=0;pe<w.length;pe++)t.bindFramebuffer(n.FRAMEBUFFER,ye.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.RENDERBUFFER,null),t.bindFramebuffer(n.FRAMEBUFFER,ye.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.TEXTURE_2D,null,0);t.bindFramebuffer(n.READ_FRAMEBUFFER,ye.__webglMultisampledFramebuffer),I.texture.mipmaps.length>0?t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ye.__webglFramebuffer[0]):t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ye.__webglFramebuffer);for(let pe=0;pe<w.length;pe++){if(I.resolveDepthBuffer&&(I.depthBuffer&&(oe|=n.DEPTH_BUFFER_BIT),I.stencilBuffer&&I.resolveStencilBuffer&&(oe|=n.STENCIL_BUFFER_BIT)),te){n.framebufferRenderbuffer(n.READ_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.RENDERBUFFER,ye.__webglColorRenderbuffer[pe]);let k=i.get(w[pe]).__webglTexture;n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,k,0)}n.blitFramebuffer(0,0,q,ue,0,0,q,ue,oe,n.NEAREST),l===!0&&(Ie.length=0,Ie.push(n.COLOR_ATTACHMENT0+pe),I.depthBuffer&&I.storeMultisampledDepthBuffer===!1&&Ie.push(ve),n.invalidateFramebuffer(n.READ_FRAMEBUFFER,Ie))}if(t.bindFramebuffer(n.READ_FRAMEBUFFER,null),t.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),te)for(let pe=0;pe<w.length;pe++){t.bindFramebuffer(n.FRAMEBUFFER,ye.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.RENDERBUFFER,ye.__webglColorRenderbuffer[pe]);let k=i.get(w[pe]).__webglTexture;t.bindFramebuffer(n.FRAMEBUFFER,ye.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+pe,n.TEXTURE_2D,k,0)}t.bindFramebuffer(n.DRAW_FRAMEBUFFER,ye.__webglMultisampledFramebuffer)}else if(I.depthBuffer&&I.storeMultisampledDepthBuffer===!1&&l){let w=I.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;n.invalidateFramebuffer(n.DRAW_FRAMEBUFFER,[w])}}}function ct(I){return Math.min(s.maxSamples,I.samples)}function we(I){let w=i.get(I);return I.samples>0&&e.has("WEBGL_multisampled_render_to_texture")===!0&&w.__useRenderToTexture!==!1}function Ht(I){let w=o.render.frame;u.get(I)!==w&&(u.set(I,w),I.update())}function He(I,w){let q=I.colorSpace,ue=I.format,oe=I.type;return I.isCompressedTexture===!0||I.isVideoTexture===!0||q!==Ha&&q!==Ys&&(St.getTransfer(q)===Dt?(ue!==as||oe!==yi)&&Je("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):Qe("WebGLTextures: Unsupported texture color space:",q)),w}function Ze(I){return typeof HTMLImageElement<"u"&&I instanceof HTMLImageElement?(c.width=I.naturalWidth||I.width,c.height=I.naturalHeight||I.height):typeof VideoFrame<"u"&&I instanceof VideoFrame?(c.width=I.displayWidth,c.height=I.displayHeight):(c.width=I.width,c.height=I.height),c}this.allocateTextureUnit=de,this.resetTextureUnits=Q,this.getTextureUnits=ie,this.setTextureUnits=he,this.setTexture2D=ge,this.setTexture2DArray=xe,this.setTexture3D=Re,this.setTextureCube=Me,this.rebindTextures=cn,this.setupRenderTarget=bn,this.updateRenderTargetMipmap=B,this.updateMultisampleRenderTarget=Ke,this.setupDepthRenderbuffer=In,this.setupFrameBufferTexture=Vt,this.useMultisampledRTT=we,this.dispose=W}function AT(n,e){function t(i,s=Ys){let r,o=St.getTransfer(s);if(i===yi)return n.UNSIGNED_BYTE;if(i===Eu)return n.UNSIGNED_SHORT_4_4_4_4;if(i===Au)return n.UNSIGNED_SHORT_5_5_5_1;if(i===kf)return n.UNSIGNED_INT_5_9_9_9_REV;if(i===Bf)return n.UNSIGNED_INT_10F_11F_11F_REV;if(i===Of)return n.BYTE;if(i===Ff)return n.SHORT;if(i===Qo)return n.UNSIGNED_SHORT;if(i===Tu)return n.INT;if(i===ss)return n.UNSIGNED_INT;if(i===rs)return n.FLOAT;if(i===os)return n.HALF_FLOAT;if(i===zf)return n.ALPHA;if(i===Vf)return n.RGB;if(i===as)return n.RGBA;if(i===Vs)return n.DEPTH_COMPONENT;if(i===qs)return n.DEPTH_STENCIL;if(i===Gf)return n.RED;if(i===Cu)return n.RED_INTEGER;if(i===yr)return n.RG;if(i===Ru)return n.RG_INTEGER;if(i===Pu)return n.RGBA_INTEGER;if(i===vl||i===xl||i===yl||i===bl)if(o===Dt)if(r=e.get("WEBGL_compressed_texture_s3tc_srgb"),r!==null){if(i===vl)return r.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(i===xl)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(i===yl)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(i===bl)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(r=e.get("WEBGL_compressed_texture_s3tc"),r!==null){if(i===vl)return r.COMPRESSED_RGB_S3TC_DXT1_EXT;if(i===xl)return r.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(i===yl)return r.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(i===bl)return r.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(i===Iu||i===Lu||i===Du||i===Nu)if(r=e.get("WEBGL_compressed_texture_pvrtc"),r!==null){if(i===Iu)return r.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(i===Lu)return r.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(i===Du)return r.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(i===Nu)return r.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(i===Uu||i===Ou||i===Fu||i===ku||i===Bu||i===Sl||i===zu)if(r=e.get("WEBGL_compressed_texture_etc"),r!==null){if(i===Uu||i===Ou)return o===Dt?r.COMPRESSED_SRGB8_ETC2:r.COMPRESSED_RGB8_ETC2;if(i===Fu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:r.COMPRESSED_RGBA8_ETC2_EAC;if(i===ku)return r.COMPRESSED_R11_EAC;if(i===Bu)return r.COMPRESSED_SIGNED_R11_EAC;if(i===Sl)return r.COMPRESSED_RG11_EAC;if(i===zu)return r.COMPRESSED_SIGNED_RG11_EAC}else return null;if(i===Vu||i===Gu||i===Hu||i===Wu||i===Xu||i===qu||i===Yu||i===$u||i===Zu||i===Ju||i===Ku||i===ju||i===Qu||i===eh)if(r=e.get("WEBGL_compressed_texture_astc"),r!==null){if(i===Vu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:r.COMPRESSED_RGBA_ASTC_4x4_KHR;if(i===Gu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:r.COMPRESSED_RGBA_ASTC_5x4_KHR;if(i===Hu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:r.COMPRESSED_RGBA_ASTC_5x5_KHR;if(i===Wu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:r.COMPRESSED_RGBA_ASTC_6x5_KHR;if(i===Xu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:r.COMPRESSED_RGBA_ASTC_6x6_KHR;if(i===qu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:r.COMPRESSED_RGBA_ASTC_8x5_KHR;if(i===Yu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:r.COMPRESSED_RGBA_ASTC_8x6_KHR;if(i===$u)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:r.COMPRESSED_RGBA_ASTC_8x8_KHR;if(i===Zu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:r.COMPRESSED_RGBA_ASTC_10x5_KHR;if(i===Ju)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:r.COMPRESSED_RGBA_ASTC_10x6_KHR;if(i===Ku)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:r.COMPRESSED_RGBA_ASTC_10x8_KHR;if(i===ju)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:r.COMPRESSED_RGBA_ASTC_10x10_KHR;if(i===Qu)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:r.COMPRESSED_RGBA_ASTC_12x10_KHR;if(i===eh)return o===Dt?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:r.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(i===th||i===nh||i===ih)if(r=e.get("EXT_texture_compression_bptc"),r!==null){if(i===th)return o===Dt?r.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:r.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(i===nh)return r.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(i===ih)return r.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(i===sh||i===rh||i===Ml||i===oh)if(r=e.get("EXT_texture_compression_rgtc"),r!==null){if(i===sh)return r.COMPRESSED_RED_RGTC1_EXT;if(i===rh)return r.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(i===Ml)return r.COMPRESSED_RED_GREEN_RGTC2_EXT;if(i===oh)return r.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return i===Wr?n.UNSIGNED_INT_24_8:n[i]!==void 0?n[i]:null}return{convert:t}}var CT=`
void main() {

	gl_Position = vec4( position, 1.0 );

}`,RT=`
uniform sampler2DArray depthColor;
uniform float depthWidth;
uniform float depthHeight;

void main() {

	vec2 coord = vec2( gl_FragCoord.x / depthWidth, gl_FragCoord.y / depthHeight );

	if ( coord.x >= 1.0 ) {

		gl_FragDepth = texture( depthColor, vec3( coord.x - 1.0, coord.y, 1 ) ).r;

	} else {

		gl_FragDepth = texture( depthColor, vec3( coord.x, coord.y, 0 ) ).r;

	}

}`,up=class{constructor(){this.texture=null,this.mesh=null,this.depthNear=0,this.depthFar=0}init(e,t){if(this.texture===null){let i=new sl(e.texture);(e.depthNear!==t.depthNear||e.depthFar!==t.depthFar)&&(this.depthNear=e.depthNear,this.depthFar=e.depthFar),this.texture=i}}getMesh(e){if(this.texture!==null&&this.mesh===null){let t=e.cameras[0].viewport,i=new Gi({vertexShader:CT,fragmentShader:RT,uniforms:{depthColor:{value:this.texture},depthWidth:{value:t.z},depthHeight:{value:t.w}}});this.mesh=new Ne(new kr(20,20),i)}return this.mesh}reset(){this.texture=null,this.mesh=null}getDepthTexture(){return this.texture}},hp=class extends es{constructor(e,t){super();let i=this,s=null,r=1,o=null,a="local-floor",l=1,c=null,u=null,f=null,d=null,p=null,g=null,v=typeof XRWebGLBinding<"u",m=new up,_={},x=t.getContextAttributes(),T=null,S=null,R=[],C=[],y=new Xe,M=null,N=null,P=new hi;P.viewport=new Nt;let D=new hi;D.viewport=new Nt;let z=[P,D],G=new bu,U=null,W=null;this.cameraAutoUpdate=!0,this.enabled=!1,this.isPresenting=!1,this.getController=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ho,R[ee]=ge),ge.getTargetRaySpace()},this.getControllerGrip=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ho,R[ee]=ge),ge.getGripSpace()},this.getHand=function(ee){let ge=R[ee];return ge===void 0&&(ge=new Ho,R[ee]=ge),ge.getHandSpace()};function $(ee){let ge=C.indexOf(ee.inputSource);if(ge===-1)return;let xe=R[ge];xe!==void 0&&(xe.update(ee.inputSource,ee.frame,c||o),xe.dispatchEvent({type:ee.type,data:ee.inputSource}))}function H(){s.removeEventListener("select",$),s.removeEventListener("selectstart",$),s.removeEventListener("selectend",$),s.removeEventListener("squeeze",$),s.removeEventListener("squeezestart",$),s.removeEventListener("squeezeend",$),s.removeEventListener("end",H),s.removeEventListener("inputsourceschange",le);for(let ee=0;ee<R.length;ee++){let ge=C[ee];ge!==null&&(C[ee]=null,R[ee].disconnect(ge))}U=null,W=null,m.reset();for(let ee in _)delete _[ee];if(e.setRenderTarget(T),p=null,d=null,f=null,s=null,S=null,de.stop(),i.isPresenting=!1,e.setPixelRatio(M),e.setSize(y.width,y.height,!1),N!==null){let ee=N.camera;ee.fov=N.fov,ee.zoom=N.zoom,ee.updateProjectionMatrix(),N=null}i.dispatchEvent({type:"sessionend"})}this.setFramebufferScaleFactor=function(ee){r=ee,i.isPresenting===!0&&Je("WebXRManager: Cannot change framebuffer scale while presenting.")},this.setReferenceSpaceType=function(ee){a=ee,i.isPresenting===!0&&Je("WebXRManager: Cannot change reference space type while presenting.")},this.getReferenceSpace=function(){return c||o},this.setReferenceSpace=function(ee){c=ee},this.getBaseLayer=function(){return d!==null?d:p},this.getBinding=function(){return f===null&&v&&(f=new XRWebGLBinding(s,t)),f},this.getFrame=function(){return g},this.getSession=function(){return s},this.setSession=async function(ee){if(s=ee,s!==null){if(T=e.getRenderTarget(),s.addEventListener("select",$),s.addEventListener("selectstart",$),s.addEventListener("selectend",$),s.addEventListener("squeeze",$),s.addEventListener("squeezestart",$),s.addEventListener("squeezeend",$),s.addEventListener("end",H),s.addEventListener("inputsourceschange",le),x.xrCompatible!==!0&&await t.makeXRCompatible(),M=e.getPixelRatio(),e.getSize(y),v&&"createProjectionLayer"in XRWebGLBinding.prototype){let xe=null,Re=null,Me=null;x.depth&&(Me=x.stencil?t.DEPTH24_STENCIL8:t.DEPTH_COMPONENT24,xe=x.stencil?qs:Vs,Re=x.stencil?Wr:ss);let Ye={colorFormat:t.RGBA8,depthFormat:Me,scaleFactor:r};f=this.getBinding(),d=f.createProjectionLayer(Ye),s.updateRenderState({layers:[d]}),e.setPixelRatio(1),e.setSize(d.textureWidth,d.textureHeight,!1),S=new Pi(d.textureWidth,d.textureHeight,{format:as,type:yi,depthTexture:new Hs(d.textureWidth,d.textureHeight,Re,void 0,void 0,void 0,void 0,void 0,void 0,xe),stencilBuffer:x.stencil,colorSpace:e.outputColorSpace,samples:x.antialias?4:0,resolveDepthBuffer:d.ignoreDepthValues===!1,resolveStencilBuffer:d.ignoreDepthValues===!1,storeMultisampledDepthBuffer:d.ignoreDepthValues===!1,storeMultisampledStencilBuffer:d.ignoreDepthValues===!1})}else{let xe={antialias:x.antialias,alpha:!0,depth:x.depth,stencil:x.stencil,framebufferScaleFactor:r};p=new XRWebGLLayer(s,t,xe),s.updateRenderState({baseLayer:p}),e.setPixelRatio(1),e.setSize(p.framebufferWidth,p.framebufferHeight,!1),S=new Pi(p.framebufferWidth,p.framebufferHeight,{format:as,type:yi,colorSpace:e.outputColorSpace,stencilBuffer:x.stencil,resolveDepthBuffer:p.ignoreDepthValues===!1,resolveStencilBuffer:p.ignoreDepthValues===!1,storeMultisampledDepthBuffer:p.ignoreDepthValues===!1,storeMultisampledStencilBuffer:p.ignoreDepthValues===!1})}S.isXRRenderTarget=!0,this.setFoveation(l),c=null,o=await s.requestReferenceSpace(a),de.setContext(s),de.start(),i.isPresenting=!0,i.dispatchEvent({type:"sessionstart"})}},this.getEnvironmentBlendMode=function(){if(s!==null)return s.environmentBlendMode},this.getDepthTexture=function(){return m.getDepthTexture()};function le(ee){for(let ge=0;ge<ee.removed.length;ge++){let xe=ee.removed[ge],Re=C.indexOf(xe);Re>=0&&(C[Re]=null,R[Re].disconnect(xe))}for(let ge=0;ge<ee.added.length;ge++){let xe=ee.added[ge],Re=C.indexOf(xe);if(Re===-1){for(let Ye=0;Ye<R.length;Ye++)if(Ye>=C.length){C.push(xe),Re=Ye;break}else if(C[Ye]===null){C[Ye]=xe,Re=Ye;break}if(Re===-1)break}let Me=R[Re];Me&&Me.connect(xe)}}function Y(ee,ge){ge===null?ee.matrixWorld.copy(ee.matrix):ee.matrixWorld.multiplyMatrices(ge.matrixWorld,ee.matrix),ee.matrixWorldInverse.copy(ee.matrixWorld).invert()}this.updateCamera=function(ee){if(s===null)return;let ge=ee.near,xe=ee.far;m.texture!==null&&(m.depthNear>0&&(ge=m.depthNear),m.depthFar>0&&(xe=m.depthFar)),G.near=D.near=P.near=ge,G.far=D.far=P.far=xe,(U!==G.near||W!==G.far)&&(s.updateRenderState({depthNear:G.near,depthFar:G.far}),U=G.near,W=G.far),G.layers.mask=ee.layers.mask|6,P.layers.mask=G.layers.mask&-5,D.layers.mask=G.layers.mask&-3;let Re=ee.parent,Me=G.cameras;Y(G,Re);for(let Ye=0;Ye<Me.length;Ye++)Y(Me[Ye],Re);G.projectionMatrix.copy(P.projectionMatrix),G.projectionMatrixInverse.copy(P.projectionMatrixInverse),N===null&&ee.isPerspectiveCamera&&(N={camera:ee,fov:ee.fov,zoom:ee.zoom}),Q(ee,G,Re)};function Q(ee,ge,xe){xe===null?ee.matrix.copy(ge.matrixWorld):(ee.matrix.copy(xe.matrixWorld),ee.matrix.invert(),ee.matrix.multiply(ge.matrixWorld)),ee.matrix.decompose(ee.position,ee.quaternion,ee.scale),ee.updateMatrixWorld(!0),ee.projectionMatrix.copy(ge.projectionMatrix),ee.projectionMatrixInverse.copy(ge.projectionMatrixInverse),ee.isPerspectiveCamera&&(ee.fov=zo*2*Math.atan(1/ee.projectionMatrix.elements[5]),ee.zoom=1)}this.getCamera=function(){return G},this.getFoveation=function(){if(!(d===null&&p===null))return l},this.setFoveation=function(ee){l=ee,d!==null&&(d.fixedFoveation=ee),p!==null&&p.fixedFoveation!==void 0&&(p.fixedFoveation=ee)},this.hasDepthSensing=function(){return m.texture!==null},this.getDepthSensingMesh=function(){return m.getMesh(G)},this.getCameraTexture=function(ee){return _[ee]};let ie=null;function he(ee,ge){if(u=ge.getViewerPose(c||o),g=ge,u!==null){let xe=u.views;p!==null&&(e.setRenderTargetFramebuffer(S,p.framebuffer),e.setRenderTarget(S));let Re=!1;xe.length!==G.cameras.length&&(G.cameras.length=0,Re=!0);for(let We=0;We<xe.length;We++){let gt=xe[We],ft=null;if(p!==null)ft=p.getViewport(gt);else{let sn=f.getViewSubImage(d,gt);ft=sn.viewport,We===0&&(e.setRenderTargetTextures(S,sn.colorTexture,sn.depthStencilTexture),e.setRenderTarget(S))}let rt=z[We];rt===void 0&&(rt=new hi,rt.layers.enable(We),rt.viewport=new Nt,z[We]=rt),rt.matrix.fromArray(gt.transform.matrix),rt.matrix.decompose(rt.position,rt.quaternion,rt.scale),rt.projectionMatrix.fromArray(gt.projectionMatrix),rt.projectionMatrixInverse.copy(rt.projectionMatrix).invert(),rt.viewport.set(ft.x,ft.y,ft.width,ft.height),We===0&&(G.matrix.copy(rt.matrix),G.matrix.decompose(G.position,G.quaternion,G.scale)),Re===!0&&G.cameras.push(rt)}let Me=s.enabledFeatures;if(Me&&Me.includes("depth-sensing")&&s.depthUsage=="gpu-optimized"&&v){f=i.getBinding();let We=f.getDepthInformation(xe[0]);We&&We.isValid&&We.texture&&m.init(We,s.renderState)}if(Me&&Me.includes("camera-access")&&v){e.state.unbindTexture(),f=i.getBinding();for(let We=0;We<xe.length;We++){let gt=xe[We].camera;if(gt){let ft=_[gt];ft||(ft=new sl,_[gt]=ft);let rt=f.getCameraImage(gt);ft.sourceTexture=rt}}}}for(let xe=0;xe<R.length;xe++){let Re=C[xe],Me=R[xe];Re!==null&&Me!==void 0&&Me.update(Re,ge,c||o)}ie&&ie(ee,ge),ge.detectedPlanes&&i.dispatchEvent({type:"planesdetected",data:ge}),g=null}let de=new f0;de.setAnimationLoop(he),this.setAnimationLoop=function(ee){ie=ee},this.dispose=function(){}}},PT=new Et,M0=new st;M0.set(-1,0,0,0,1,0,0,0,1);function IT(n,e){function t(m,_){m.matrixAutoUpdate===!0&&m.updateMatrix(),_.value.copy(m.matrix)}function i(m,_){_.color.getRGB(m.fogColor.value,jf(n)),_.isFog?(m.fogNear.value=_.near,m.fogFar.value=_.far):_.isFogExp2&&(m.fogDensity.value=_.density)}function s(m,_,x,T,S){_.isNodeMaterial?_.uniformsNeedUpdate=!1:_.isMeshBasicMaterial?r(m,_):_.isMeshLambertMaterial?(r(m,_),_.envMap&&(m.envMapIntensity.value=_.envMapIntensity)):_.isMeshToonMaterial?(r(m,_),f(m,_)):_.isMeshPhongMaterial?(r(m,_),u(m,_),_.envMap&&(m.envMapIntensity.value=_.envMapIntensity)):_.isMeshStandardMaterial?(r(m,_),d(m,_),_.isMeshPhysicalMaterial&&p(m,_,S)):_.isMeshMatcapMaterial?(r(m,_),g(m,_)):_.isMeshDepthMaterial?r(m,_):_.isMeshDistanceMaterial?(r(m,_),v(m,_)):_.isMeshNormalMaterial?r(m,_):_.isLineBasicMaterial?(o(m,_),_.isLineDashedMaterial&&a(m,_)):_.isPointsMaterial?l(m,_,x,T):_.isSpriteMaterial?c(m,_):_.isShadowMaterial?(m.color.value.copy(_.color),m.opacity.value=_.opacity):_.isShaderMaterial&&(_.uniformsNeedUpdate=!1)}function r(m,_){m.opacity.value=_.opacity,_.color&&m.diffuse.value.copy(_.color),_.emissive&&m.emissive.value.copy(_.emissive).multiplyScalar(_.emissiveIntensity),_.map&&(m.map.value=_.map,t(_.map,m.mapTransform)),_.alphaMap&&(m.alphaMap.value=_.alphaMap,t(_.alphaMap,m.alphaMapTransform)),_.bumpMap&&(m.bumpMap.value=_.bumpMap,t(_.bumpMap,m.bumpMapTransform),m.bumpScale.value=_.bumpScale,_.side===pi&&(m.bumpScale.value*=-1)),_.normalMap&&(m.normalMap.value=_.normalMap,t(_.normalMap,m.normalMapTransform),m.normalScale.value.copy(_.normalScale),_.side===pi&&m.normalScale.value.negate()),_.displacementMap&&(m.displacementMap.value=_.displacementMap,t(_.displacementMap,m.displacementMapTransform),m.displacementScale.value=_.displacementScale,m.displacementBias.value=_.displacementBias),_.emissiveMap&&(m.emissiveMap.value=_.emissiveMap,t(_.emissiveMap,m.emissiveMapTransform)),_.specularMap&&(m.specularMap.value=_.specularMap,t(_.specularMap,m.specularMapTransform)),_.alphaTest>0&&(m.alphaTest.value=_.alphaTest);let x=e.get(_),T=x.envMap,S=x.envMapRotation;T&&(m.envMap.value=T,m.envMapRotation.value.setFromMatrix4(PT.makeRotationFromEuler(S)).transpose(),T.isCubeTexture&&T.isRenderTargetTexture===!1&&m.envMapRotation.value.premultiply(M0),m.reflectivity.value=_.reflectivity,m.ior.value=_.ior,m.refractionRatio.value=_.refractionRatio),_.lightMap&&(m.lightMap.value=_.lightMap,m.lightMapIntensity.value=_.lightMapIntensity,t(_.lightMap,m.lightMapTransform)),_.aoMap&&(m.aoMap.value=_.aoMap,m.aoMapIntensity.value=_.aoMapIntensity,t(_.aoMap,m.aoMapTransform))}function o(m,_){m.diffuse.value.copy(_.color),m.opacity.value=_.opacity,_.map&&(m.map.value=_.map,t(_.map,m.mapTransform))}function a(m,_){m.dashSize.value=_.dashSize,m.totalSize.value=_.dashSize+_.gapSize,m.scale.value=_.scale}function l(m,_,x,T){m.diffuse.value.copy(_.color),m.opacity.value=_.opacity,m.size.value=_.size*x,m.scale.value=T*.5,_.map&&(m.map.value=_.map,t(_.map,m.uvTransform)),_.alphaMap&&(m.alphaMap.value=_.alphaMap,t(_.alphaMap,m.alphaMapTransform)),_.alphaTest>0&&(m.alphaTest.value=_.alphaTest)}function c(m,_){m.diffuse.value.copy(_.color),m.opacity.value=_.opacity,m.rotation.value=_.rotation,_.map&&(m.map.value=_.map,t(_.map,m.mapTransform)),_.alphaMap&&(m.alphaMap.value=_.alphaMap,t(_.alphaMap,m.alphaMapTransform)),_.alphaTest>0&&(m.alphaTest.value=_.alphaTest)}function u(m,_){m.specular.value.copy(_.specular),m.shininess.value=Math.max(_.shininess,1e-4)}function f(m,_){_.gradientMap&&(m.gradientMap.value=_.gradientMap)}function d(m,_){m.metalness.value=_.metalness,_.metalnessMap&&(m.metalnessMap.value=_.metalnessMap,t(_.metalnessMap,m.metalnessMapTransform)),m.roughness.value=_.roughness,_.roughnessMap&&(m.roughnessMap.value=_.roughnessMap,t(_.roughnessMap,m.roughnessMapTransform)),_.envMap&&(m.envMapIntensity.value=_.envMapIntensity)}function p(m,_,x){m.ior.value=_.ior,_.diffuseRoughness>0&&(m.diffuseRoughness.value=_.diffuseRoughness,_.diffuseRoughnessMap&&(m.diffuseRoughnessMap.value=_.diffuseRoughnessMap,t(_.diffuseRoughnessMap,m.diffuseRoughnessMapTransform))),_.sheen>0&&(m.sheenColor.value.copy(_.sheenColor).multiplyScalar(_.sheen),m.sheenRoughness.value=_.sheenRoughness,_.sheenColorMap&&(m.sheenColorMap.value=_.sheenColorMap,t(_.sheenColorMap,m.sheenColorMapTransform)),_.sheenRoughnessMap&&(m.sheenRoughnessMap.value=_.sheenRoughnessMap,t(_.sheenRoughnessMap,m.sheenRoughnessMapTransform))),_.clearcoat>0&&(m.clearcoat.value=_.clearcoat,m.clearcoatRoughness.value=_.clearcoatRoughness,_.clearcoatMap&&(m.clearcoatMap.value=_.clearcoatMap,t(_.clearcoatMap,m.clearcoatMapTransform)),_.clearcoatRoughnessMap&&(m.clearcoatRoughnessMap.value=_.clearcoatRoughnessMap,t(_.clearcoatRoughnessMap,m.clearcoatRoughnessMapTransform)),_.clearcoatNormalMap&&(m.clearcoatNormalMap.value=_.clearcoatNormalMap,t(_.clearcoatNormalMap,m.clearcoatNormalMapTransform),m.clearcoatNormalScale.value.copy(_.clearcoatNormalScale),_.side===pi&&m.clearcoatNormalScale.value.negate())),_.dispersion>0&&(m.dispersion.value=_.dispersion),_.retroreflectivity>0&&(m.retroreflectivity.value=_.retroreflectivity),_.iridescence>0&&(m.iridescence.value=_.iridescence,m.iridescenceIOR.value=_.iridescenceIOR,m.iridescenceThicknessMinimum.value=_.iridescenceThicknessMinimum,m.iridescenceThicknessMaximum.value=_.iridescenceThicknessMaximum,_.iridescenceMap&&(m.iridescenceMap.value=_.iridescenceMap,t(_.iridescenceMap,m.iridescenceMapTransform)),_.iridescenceThicknessMap&&(m.iridescenceThicknessMap.value=_.iridescenceThicknessMap,t(_.iridescenceThicknessMap,m.iridescenceThicknessMapTransform))),_.transmission>0&&(m.transmission.value=_.transmission,m.transmissionSamplerMap.value=x.texture,m.transmissionSamplerSize.value.set(x.width,x.height),_.transmissionMap&&(m.transmissionMap.value=_.transmissionMap,t(_.transmissionMap,m.transmissionMapTransform)),m.thickness.value=_.thickness,_.thicknessMap&&(m.thicknessMap.value=_.thicknessMap,t(_.thicknessMap,m.thicknessMapTransform)),m.attenuationDistance.value=_.attenuationDistance,m.attenuationColor.value.copy(_.attenuationColor)),_.anisotropy>0&&(m.anisotropyVector.value.set(_.anisotropy*Math.cos(_.anisotropyRotation),_.anisotropy*Math.sin(_.anisotropyRotation)),_.anisotropyMap&&(m.anisotropyMap.value=_.anisotropyMap,t(_.anisotropyMap,m.anisotropyMapTransform))),m.specularIntensity.value=_.specularIntensity,m.specularColor.value.copy(_.specularColor),_.specularColorMap&&(m.specularColorMap.value=_.specularColorMap,t(_.specularColorMap,m.specularColorMapTransform)),_.specularIntensityMap&&(m.specularIntensityMap.value=_.specularIntensityMap,t(_.specularIntensityMap,m.specularIntensityMapTransform))}function g(m,_){_.matcap&&(m.matcap.value=_.matcap)}function v(m,_){let x=e.get(_).light;m.referencePosition.value.setFromMatrixPosition(x.matrixWorld),m.nearDistance.value=x.shadow.camera.near,m.farDistance.value=x.shadow.camera.far}return{refreshFogUniforms:i,refreshMaterialUniforms:s}}function LT(n,e,t,i){let s={},r={};function o(x,T){let S=T.program;i.uniformBlockBinding(x,S,s[x.id])}function a(x,T){let S=s[x.id];S===void 0&&(g(x),S=l(x),s[x.id]=S,x.addEventListener("dispose",m));let R=T.program;i.updateUBOMapping(x,R);let C=e.render.frame;r[x.id]!==C&&(c(x),r[x.id]=C)}function l(x){let T=n.createBuffer(),S=x.__size,R=x.usage;return n.bindBuffer(n.UNIFORM_BUFFER,T),n.bufferData(n.UNIFORM_BUFFER,S,R),n.bindBuffer(n.UNIFORM_BUFFER,null),T}function c(x){let T=s[x.id],S=x.uniforms,R=x.__cache;n.bindBuffer(n.UNIFORM_BUFFER,T);for(let C=0,y=S.length;C<y;C++){let M=S[C];if(Array.isArray(M))for(let N=0,P=M.length;N<P;N++)u(M[N],C,N,R);else u(M,C,0,R)}n.bindBuffer(n.UNIFORM_BUFFER,null)}function u(x,T,S,R){if(d(x,T,S,R)===!0){let C=x.__offset,y=x.value;if(Array.isArray(y)){let M=0;for(let N=0;N<y.length;N++){let P=y[N],D=v(P,!0);f(P,x.__data,M),M+=D.storage/Float32Array.BYTES_PER_ELEMENT}}else f(y,x.__data,0);n.bufferSubData(n.UNIFORM_BUFFER,C,x.__data)}}function f(x,T,S){typeof x=="number"||typeof x=="boolean"?T[S]=x:x.isMatrix3?(T[S]=x.elements[0],T[S+1]=x.elements[1],T[S+2]=x.elements[2],T[S+3]=0,T[S+4]=x.elements[3],T[S+5]=x.elements[4],T[S+6]=x.elements[5],T[S+7]=0,T[S+8]=x.elements[6],T[S+9]=x.elements[7],T[S+10]=x.elements[8],T[S+11]=0):ArrayBuffer.isView(x)?T.set(x.subarray(0,T.length-S),S):x.toArray(T,S)}function d(x,T,S,R){let C=x.value,y=T+"_"+S;if(Array.isArray(C)){R[y]===void 0&&(R[y]=[]);let M=R[y],N=!1;for(let P=0;P<C.length;P++)p(C[P],M,P)===!0&&(N=!0);return N}return p(C,R,y)}function p(x,T,S){if(T[S]===void 0)return typeof x=="number"||typeof x=="boolean"?T[S]=x:ArrayBuffer.isView(x)?T[S]=x.slice():T[S]=x.clone(),!0;{let R=T[S];if(typeof x=="number"||typeof x=="boolean"){if(R!==x)return T[S]=x,!0}else{if(ArrayBuffer.isView(x))return!0;if(R.equals(x)===!1)return R.copy(x),!0}}return!1}function g(x){let T=x.uniforms,S=0,R=16;for(let y=0,M=T.length;y<M;y++){let N=Array.isArray(T[y])?T[y]:[T[y]];for(let P=0,D=N.length;P<D;P++){let z=N[P],G=Array.isArray(z.value)?z.value:[z.value],U=Array.isArray(T[y])||Array.isArray(z.value),W=S;for(let H=0,le=G.length;H<le;H++){let Y=G[H],Q=v(Y,U),ie=S%R,he=ie%Q.boundary,de=ie+he;S+=he,de!==0&&R-de<Q.storage&&(S+=R-de),H===0&&(W=S),S+=Q.storage}let $=z.type==="int"?Int32Array:z.type==="uint"?Uint32Array:Float32Array;z.__data=new $((S-W)/Float32Array.BYTES_PER_ELEMENT),z.__offset=W}}let C=S%R;return C>0&&(S+=R-C),x.__size=S,x.__cache={},this}function v(x,T){let S={boundary:0,storage:0};return typeof x=="number"||typeof x=="boolean"?(S.boundary=4,S.storage=4):x.isVector2?(S.boundary=8,S.storage=8):x.isVector3||x.isColor?(S.boundary=16,S.storage=12):x.isVector4?(S.boundary=16,S.storage=16):x.isMatrix3?(S.boundary=16,S.storage=48):x.isMatrix4?(S.boundary=16,S.storage=64):x.isTexture?Je("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(x)?(S.boundary=16,S.storage=x.byteLength):Je("WebGLRenderer: Unsupported uniform value type.",x),T===!0&&(S.boundary=16,S.storage=Math.ceil(S.storage/16)*16),S}function m(x){let T=x.target;T.removeEventListener("dispose",m),n.deleteBuffer(s[T.id]),delete s[T.id],delete r[T.id]}function _(){for(let x in s)n.deleteBuffer(s[x]);s={},r={}}return{bind:o,update:a,dispose:_}}var DT=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]),Ms=null;function NT(){return Ms===null&&(Ms=new nu(DT,16,16,yr,os),Ms.name="DFG_LUT",Ms.minFilter=di,Ms.magFilter=di,Ms.wrapS=bs,Ms.wrapT=bs,Ms.generateMipmaps=!1,Ms.needsUpdate=!0),Ms}var dh=class{constructor(e={}){let{canvas:t=k_(),context:i=null,depth:s=!0,stencil:r=!1,alpha:o=!1,antialias:a=!1,premultipliedAlpha:l=!0,preserveDrawingBuffer:c=!1,powerPreference:u="default",failIfMajorPerformanceCaveat:f=!1,reversedDepthBuffer:d=!1,outputBufferType:p=yi}=e;this.isWebGLRenderer=!0;let g;if(i!==null){if(typeof WebGLRenderingContext<"u"&&i instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");g=i.getContextAttributes().alpha}else g=o;let v=p,m=new Set([Pu,Ru,Cu]),_=new Set([yi,ss,Qo,Wr,Eu,Au]),x=new Uint32Array(4),T=new Int32Array(4),S={textures:[],min:[],max:[],resolution:[]},R=null,C=null,y=[],M=[],N=null;this.domElement=t,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=Ss,this.toneMappingExposure=1,this.transmissionResolutionScale=1;let P=this,D=!1,z=null,G=null,U=null,W=null;this._outputColorSpace=ui;let $=0,H=0,le=null,Y=-1,Q=null,ie=new Nt,he=new Nt,de=null,ee=new it(0),ge=0,xe=t.width,Re=t.height,Me=1,Ye=null,lt=null,We=new Nt(0,0,xe,Re),gt=new Nt(0,0,xe,Re),ft=!1,rt=new ur,sn=new iu,Yt=!1,yn=!1,Vt=new Et,Bn=new O,Tt=new Nt,In={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0},cn=!1;function bn(){return le===null?Me:1}let B=i;function Ie(A,V){return t.getContext(A,V)}let Ke,ct,we,Ht,He,Ze,I,w,q,ue,oe,ve,ye,te,se,pe,k,re,ne,Te,_e,Se,qe;try{let A={alpha:!0,depth:s,stencil:r,antialias:a,premultipliedAlpha:l,preserveDrawingBuffer:c,powerPreference:u,failIfMajorPerformanceCaveat:f};if("setAttribute"in t&&t.setAttribute("data-engine",`three.js r${"187"}`),t.addEventListener("webglcontextlost",ze,!1),t.addEventListener("webglcontextrestored",tt,!1),t.addEventListener("webglcontextcreationerror",Pe,!1),B===null){let V="webgl2";if(B=Ie(V,A),B===null)throw Ie(V)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}et()}catch(A){throw t.removeEventListener("webglcontextlost",ze,!1),t.removeEventListener("webglcontextrestored",tt,!1),t.removeEventListener("webglcontextcreationerror",Pe,!1),Qe("WebGLRenderer: "+A.message),A}function et(){Ke=new Xw(B),Ke.init(),_e=new AT(B,Ke),ct=new Nw(B,Ke,e,_e),we=new TT(B,Ke),ct.reversedDepthBuffer&&d&&we.buffers.depth.setReversed(!0),G=B.createFramebuffer(),U=B.createFramebuffer(),W=B.createFramebuffer(),Ht=new $w(B),He=new hT,Ze=new ET(B,Ke,we,He,ct,_e,Ht),I=new Ww(P),w=new Jb(B),Se=new Lw(B,w),q=new qw(B,w,Ht,Se),ue=new Jw(B,q,w,Se,Ht),re=new Zw(B,ct,Ze),se=new Uw(He),oe=new uT(P,I,Ke,ct,Se,se),ve=new IT(P,He),ye=new fT,te=new xT(Ke),k=new Iw(P,I,we,ue,g,l),pe=new wT(P,ue,ct),qe=new LT(B,Ht,ct,we),ne=new Dw(B,Ke,Ht),Te=new Yw(B,Ke,Ht),Ht.programs=oe.programs,P.capabilities=ct,P.extensions=Ke,P.properties=He,P.renderLists=ye,P.shadowMap=pe,P.state=we,P.info=Ht}v!==yi&&(N=new jw(v,t.width,t.height,a,s,r));let ce=new hp(P,B);this.xr=ce,this.getContext=function(){return B},this.getContextAttributes=function(){return B.getContextAttributes()},this.forceContextLoss=function(){let A=Ke.get("WEBGL_lose_context");A&&A.loseContext()},this.forceContextRestore=function(){let A=Ke.get("WEBGL_lose_context");A&&A.restoreContext()},this.getPixelRatio=function(){return Me},this.setPixelRatio=function(A){A!==void 0&&(Me=A,this.setSize(xe,Re,!1))},this.getSize=function(A){return A.set(xe,Re)},this.setSize=function(A,V,j=!0){if(ce.isPresenting){Je("WebGLRenderer: Can't change size while VR device is presenting.");return}xe=A,Re=V,t.width=Math.floor(A*Me),t.height=Math.floor(V*Me),j===!0&&(t.style.width=A+"px",t.style.height=V+"px"),N!==null&&N.setSize(t.width,t.height),this.setViewport(0,0,A,V)},this.getDrawingBufferSize=function(A){return A.set(xe*Me,Re*Me).floor()},this.setDrawingBufferSize=function(A,V,j){xe=A,Re=V,Me=j,t.width=Math.floor(A*j),t.height=Math.floor(V*j),this.setViewport(0,0,A,V)},this.setEffects=function(A){if(v===yi){Qe("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(A){for(let V=0;V<A.length;V++)if(A[V].isOutputPass===!0){Je("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}N.setEffects(A||[])},this.getCurrentViewport=function(A){return A.copy(ie)},this.getViewport=function(A){return A.copy(We)},this.setViewport=function(A,V,j,Z){A.isVector4?We.set(A.x,A.y,A.z,A.w):We.set(A,V,j,Z),we.viewport(ie.copy(We).multiplyScalar(bn()).round())},this.getScissor=function(A){return A.copy(gt)},this.setScissor=function(A,V,j,Z){A.isVector4?gt.set(A.x,A.y,A.z,A.w):gt.set(A,V,j,Z),we.scissor(he.copy(gt).multiplyScalar(bn()).round())},this.getScissorTest=function(){return ft},this.setScissorTest=function(A){we.setScissorTest(ft=A)},this.setOpaqueSort=function(A){Ye=A},this.setTransparentSort=function(A){lt=A},this.getClearColor=function(A){return A.copy(k.getClearColor())},this.setClearColor=function(){k.setClearColor(...arguments)},this.getClearAlpha=function(){return k.getClearAlpha()},this.setClearAlpha=function(){k.setClearAlpha(...arguments)},this.clear=function(A=!0,V=!0,j=!0){let Z=0;if(A){let J=!1;if(le!==null){let Ee=le.texture.format;J=m.has(Ee)}if(J){let Ee=le.texture.type,De=_.has(Ee),Ae=k.getClearColor(),Ue=k.getClearAlpha(),Ge=Ae.r,nt=Ae.g,_t=Ae.b;De?(x[0]=Ge,x[1]=nt,x[2]=_t,x[3]=Ue,B.clearBufferuiv(B.COLOR,0,x)):(T[0]=Ge,T[1]=nt,T[2]=_t,T[3]=Ue,B.clearBufferiv(B.COLOR,0,T))}else Z|=B.COLOR_BUFFER_BIT}V&&(Z|=B.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),j&&(Z|=B.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),Z!==0&&B.clear(Z)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(A){A.setRenderer(this),z=A},this.dispose=function(){t.removeEventListener("webglcontextlost",ze,!1),t.removeEventListener("webglcontextrestored",tt,!1),t.removeEventListener("webglcontextcreationerror",Pe,!1),k.dispose(),ye.dispose(),te.dispose(),Ze.dispose(),He.dispose(),I.dispose(),ue.dispose(),q.dispose(),Se.dispose(),qe.dispose(),oe.dispose(),ce.dispose(),ce.removeEventListener("sessionstart",Gl),ce.removeEventListener("sessionend",ds),Ps.stop()};function ze(A){A.preventDefault(),qa("WebGLRenderer: Context Lost."),D=!0}function tt(){qa("WebGLRenderer: Context Restored."),D=!1;let A=Ht.autoReset,V=pe.enabled,j=pe.autoUpdate,Z=pe.needsUpdate,J=pe.type;et(),Ht.autoReset=A,pe.enabled=V,pe.autoUpdate=j,pe.needsUpdate=Z,pe.type=J}function Pe(A){Qe("WebGLRenderer: A WebGL context could not be created. Reason: ",A.statusMessage)}function dt(A){let V=A.target;V.removeEventListener("dispose",dt),Zt(V)}function Zt(A){ii(A),He.remove(A)}function ii(A){let V=He.get(A).programs;V!==void 0&&(V.forEach(function(j){oe.releaseProgram(j)}),A.isShaderMaterial&&oe.releaseShaderCache(A))}this.renderBufferDirect=function(A,V,j,Z,J,Ee){V===null&&(V=In);let De=J.isMesh&&J.matrixWorld.determinantAffine()<0,Ae=xa(A,V,j,Z,J);we.setMaterial(Z,De);let Ue=j.index,Ge=1;if(Z.wireframe===!0){if(Ue=q.getWireframeAttribute(j),Ue===void 0)return;Ge=2}let nt=j.drawRange,_t=j.attributes.position,Ve=nt.start*Ge,vt=(nt.start+nt.count)*Ge;Ee!==null&&(Ve=Math.max(Ve,Ee.start*Ge),vt=Math.min(vt,(Ee.start+Ee.count)*Ge)),Ue!==null?(Ve=Math.max(Ve,0),vt=Math.min(vt,Ue.count)):_t!=null&&(Ve=Math.max(Ve,0),vt=Math.min(vt,_t.count));let an=vt-Ve;if(an<0||an===1/0)return;Se.setup(J,Z,Ae,j,Ue);let Ot,Ft=ne;if(Ue!==null&&(Ot=w.get(Ue),Ft=Te,Ft.setIndex(Ot)),J.isMesh)Z.wireframe===!0?(we.setLineWidth(Z.wireframeLinewidth*bn()),Ft.setMode(B.LINES)):Ft.setMode(B.TRIANGLES);else if(J.isLine){let Ln=Z.linewidth;Ln===void 0&&(Ln=1),we.setLineWidth(Ln*bn()),J.isLineSegments?Ft.setMode(B.LINES):J.isLineLoop?Ft.setMode(B.LINE_LOOP):Ft.setMode(B.LINE_STRIP)}else J.isPoints?Ft.setMode(B.POINTS):J.isSprite&&Ft.setMode(B.TRIANGLES);if(J.isBatchedMesh)if(Ke.get("WEBGL_multi_draw"))Ft.renderMultiDraw(J._multiDrawStarts,J._multiDrawCounts,J._multiDrawCount);else{let Ln=J._multiDrawStarts,ke=J._multiDrawCounts,Sn=J._multiDrawCount,bt=Ue?w.get(Ue).bytesPerElement:1,Ls=He.get(Z).currentProgram.getUniforms();for(let Mn=0;Mn<Sn;Mn++)Ls.setValue(B,"_gl_DrawID",Mn),Ft.render(Ln[Mn]/bt,ke[Mn])}else if(J.isInstancedMesh)Ft.renderInstances(Ve,an,J.count);else if(j.isInstancedBufferGeometry){let Ln=j._maxInstanceCount!==void 0?j._maxInstanceCount:1/0,ke=Math.min(j.instanceCount,Ln);Ft.renderInstances(Ve,an,ke)}else Ft.render(Ve,an)};function ga(A,V,j,Z){z!==null&&A.isNodeMaterial&&z.setObject(Z,A),Yt===!0&&se.setState(A,j,!1),A.transparent===!0&&A.side===xi&&A.forceSinglePass===!1?(A.side=pi,A.needsUpdate=!0,fs(A,V,Z),A.side=xr,A.needsUpdate=!0,fs(A,V,Z),A.side=xi):fs(A,V,Z)}this.compile=function(A,V,j=null){j===null&&(j=A),z!==null&&z.renderStart(A,V,j),C=te.get(j),C.init(V),M.push(C),j.traverseVisible(function(J){J.isLight&&J.layers.test(V.layers)&&(C.pushLight(J),J.castShadow&&C.pushShadow(J))}),A!==j&&A.traverseVisible(function(J){J.isLight&&J.layers.test(V.layers)&&(C.pushLight(J),J.castShadow&&C.pushShadow(J))}),C.setupLights(),z!==null&&z.updateLights(C.state.lightsArray),yn=this.localClippingEnabled,Yt=se.init(this.clippingPlanes,yn),Yt===!0&&se.setGlobalState(this.clippingPlanes,V),z!==null&&pe.render(C.state.shadowsArray,j,V);let Z=new Set;return A.traverse(function(J){if(!(J.isMesh||J.isPoints||J.isLine||J.isSprite))return;let Ee=J.material;if(Ee)if(Array.isArray(Ee))for(let De=0;De<Ee.length;De++){let Ae=Ee[De];ga(Ae,j,V,J),Z.add(Ae)}else ga(Ee,j,V,J),Z.add(Ee)}),C=M.pop(),z!==null&&z.renderEnd(),Z},this.compileAsync=function(A,V,j=null){let Z=this.compile(A,V,j);return new Promise(J=>{function Ee(){if(Z.forEach(function(De){let Ue=He.get(De).currentProgram;(Ue===void 0||Ue.isReady())&&Z.delete(De)}),Z.size===0){J(A);return}setTimeout(Ee,10)}Ke.get("KHR_parallel_shader_compile")!==null?Ee():setTimeout(Ee,10)})};let to=null;function sd(A){to&&to(A)}function Gl(){Ps.stop()}function ds(){Ps.start()}let Ps=new f0;Ps.setAnimationLoop(sd),typeof self<"u"&&Ps.setContext(self),this.setAnimationLoop=function(A){to=A,ce.setAnimationLoop(A),A===null?Ps.stop():Ps.start()},ce.addEventListener("sessionstart",Gl),ce.addEventListener("sessionend",ds),this.render=function(A,V){if(V!==void 0&&V.isCamera!==!0){Qe("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(D===!0)return;z!==null&&z.renderStart(A,V);let j=ce.enabled===!0&&ce.isPresenting===!0,Z=N!==null&&(le===null||j)&&N.begin(P,le);if(A.matrixWorldAutoUpdate===!0&&A.updateMatrixWorld(),V.parent===null&&V.matrixWorldAutoUpdate===!0&&V.updateMatrixWorld(),ce.enabled===!0&&ce.isPresenting===!0&&(N===null||N.isCompositing()===!1)&&(ce.cameraAutoUpdate===!0&&ce.updateCamera(V),V=ce.getCamera()),A.isScene===!0&&A.onBeforeRender(P,A,V,le),C=te.get(A,M.length),C.init(V),C.state.textureUnits=Ze.getTextureUnits(),M.push(C),Vt.multiplyMatrices(V.projectionMatrix,V.matrixWorldInverse),V.isArrayCamera?sn.setFromArrayCamera(V):rt.setFromProjectionMatrix(Vt,zi,V.reversedDepth),yn=this.localClippingEnabled,Yt=se.init(this.clippingPlanes,yn),R=ye.get(A,y.length),R.init(),y.push(R),this.info.render.frame++,ce.enabled===!0&&ce.isPresenting===!0){let De=P.xr.getDepthSensingMesh();De!==null&&Is(De,V,-1/0,P.sortObjects)}Is(A,V,0,P.sortObjects),R.finish(),z!==null&&z.updateLights(C.state.lightsArray),P.sortObjects===!0&&R.sort(Ye,lt),cn=ce.enabled===!1||ce.isPresenting===!1||ce.hasDepthSensing()===!1,cn&&k.addToRenderList(R,A),this.info.autoReset===!0&&this.info.reset(),Yt===!0&&se.beginShadows();let J=C.state.shadowsArray;if(pe.render(J,A,V),Yt===!0&&se.endShadows(),(Z&&N.hasRenderPass())===!1){let De=R.opaque,Ae=R.transmissive;if(C.setupLights(),V.isArrayCamera){let Ue=V.cameras;if(Ae.length>0)for(let Ge=0,nt=Ue.length;Ge<nt;Ge++){let _t=Ue[Ge];qi(De,Ae,A,_t)}cn&&k.render(A);for(let Ge=0,nt=Ue.length;Ge<nt;Ge++){let _t=Ue[Ge];_a(R,A,_t,_t.viewport)}}else Ae.length>0&&qi(De,Ae,A,V),cn&&k.render(A),_a(R,A,V)}le!==null&&H===0&&(Ze.updateMultisampleRenderTarget(le),Ze.updateRenderTargetMipmap(le)),Z&&N.end(P),A.isScene===!0&&A.onAfterRender(P,A,V),Se.resetDefaultState(),Y=-1,Q=null,M.pop(),M.length>0?(C=M[M.length-1],Ze.setTextureUnits(C.state.textureUnits),Yt===!0&&se.setGlobalState(P.clippingPlanes,C.state.camera)):C=null,y.pop(),y.length>0?R=y[y.length-1]:R=null,z!==null&&z.renderEnd()};function Is(A,V,j,Z){if(A.visible===!1)return;if(A.layers.test(V.layers)){if(A.isGroup)j=A.renderOrder;else if(A.isLOD)A.autoUpdate===!0&&A.update(V);else if(A.isLight)C.pushLight(A),A.castShadow&&C.pushShadow(A);else if(A.isSprite){let De=V.isArrayCamera?sn:rt;if(!A.frustumCulled||A.intersectsFrustum(De)){Z&&Tt.setFromMatrixPosition(A.matrixWorld).applyMatrix4(Vt);let Ae=ue.update(A),Ue=A.material;Ue.visible&&R.push(A,Ae,Ue,j,Tt.z,null,V)}}else if(A.isMesh||A.isLine||A.isPoints){let De=V.isArrayCamera?sn:rt;if(!A.frustumCulled||A.intersectsFrustum(De)){let Ae=ue.update(A),Ue=A.material;if(Z&&(A.boundingSphere!==void 0?(A.boundingSphere===null&&A.computeBoundingSphere(),Tt.copy(A.boundingSphere.center)):(Ae.boundingSphere===null&&Ae.computeBoundingSphere(),Tt.copy(Ae.boundingSphere.center)),Tt.applyMatrix4(A.matrixWorld).applyMatrix4(Vt)),Array.isArray(Ue)){let Ge=Ae.groups;for(let nt=0,_t=Ge.length;nt<_t;nt++){let Ve=Ge[nt],vt=Ue[Ve.materialIndex];vt&&vt.visible&&R.push(A,Ae,vt,j,Tt.z,Ve,V)}}else Ue.visible&&R.push(A,Ae,Ue,j,Tt.z,null,V)}}}let Ee=A.children;for(let De=0,Ae=Ee.length;De<Ae;De++)Is(Ee[De],V,j,Z)}function _a(A,V,j,Z){let{opaque:J,transmissive:Ee,transparent:De}=A;C.setupLightsView(j),Yt===!0&&se.setGlobalState(P.clippingPlanes,j),Z&&we.viewport(ie.copy(Z)),J.length>0&&un(J,V,j),Ee.length>0&&un(Ee,V,j),De.length>0&&un(De,V,j),we.buffers.depth.setTest(!0),we.buffers.depth.setMask(!0),we.buffers.color.setMask(!0),we.setPolygonOffset(!1)}function qi(A,V,j,Z){if((j.isScene===!0?j.overrideMaterial:null)!==null)return;if(C.state.transmissionRenderTarget[Z.id]===void 0){let Ve=Ke.has("EXT_color_buffer_half_float")||Ke.has("EXT_color_buffer_float");C.state.transmissionRenderTarget[Z.id]=new Pi(1,1,{generateMipmaps:!0,type:Ve?os:yi,minFilter:Xs,samples:Math.max(4,ct.samples),stencilBuffer:r,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:St.workingColorSpace})}let Ee=C.state.transmissionRenderTarget[Z.id],De=Z.viewport||ie;Ee.setSize(De.z*P.transmissionResolutionScale,De.w*P.transmissionResolutionScale);let Ae=P.getRenderTarget(),Ue=P.getActiveCubeFace(),Ge=P.getActiveMipmapLevel();P.setRenderTarget(Ee),P.getClearColor(ee),ge=P.getClearAlpha(),ge<1&&P.setClearColor(16777215,.5),P.clear(),cn&&k.render(j);let nt=P.toneMapping;P.toneMapping=Ss;let _t=Z.viewport;if(Z.viewport!==void 0&&(Z.viewport=void 0),C.setupLightsView(Z),Yt===!0&&se.setGlobalState(P.clippingPlanes,Z),un(A,j,Z),Ze.updateMultisampleRenderTarget(Ee),Ze.updateRenderTargetMipmap(Ee),Ke.has("WEBGL_multisampled_render_to_texture")===!1){let Ve=!1;for(let vt=0,an=V.length;vt<an;vt++){let Ot=V[vt],{object:Ft,geometry:Ln,material:ke,group:Sn}=Ot;if(ke.side===xi&&Ft.layers.test(Z.layers)){let bt=ke.side;ke.side=pi,ke.needsUpdate=!0,gn(Ft,j,Z,Ln,ke,Sn),ke.side=bt,ke.needsUpdate=!0,Ve=!0}}Ve===!0&&(Ze.updateMultisampleRenderTarget(Ee),Ze.updateRenderTargetMipmap(Ee))}P.setRenderTarget(Ae,Ue,Ge),P.setClearColor(ee,ge),_t!==void 0&&(Z.viewport=_t),P.toneMapping=nt}function un(A,V,j){let Z=V.isScene===!0?V.overrideMaterial:null;for(let J=0,Ee=A.length;J<Ee;J++){let De=A[J],{object:Ae,geometry:Ue,group:Ge}=De,nt=De.material;nt.allowOverride===!0&&Z!==null&&(nt=Z),Ae.layers.test(j.layers)&&gn(Ae,V,j,Ue,nt,Ge)}}function gn(A,V,j,Z,J,Ee){z!==null&&J.isNodeMaterial&&z.setObject(A,J),A.onBeforeRender(P,V,j,Z,J,Ee),A.modelViewMatrix.multiplyMatrices(j.matrixWorldInverse,A.matrixWorld),A.normalMatrix.getNormalMatrix(A.modelViewMatrix),J.onBeforeRender(P,V,j,Z,A,Ee),J.transparent===!0&&J.side===xi&&J.forceSinglePass===!1?(J.side=pi,J.needsUpdate=!0,P.renderBufferDirect(j,V,Z,J,A,Ee),J.side=xr,J.needsUpdate=!0,P.renderBufferDirect(j,V,Z,J,A,Ee),J.side=xi):P.renderBufferDirect(j,V,Z,J,A,Ee),A.onAfterRender(P,V,j,Z,J,Ee)}function _n(A){let V=0;for(let j of A)j.texture!==null&&V++;return V}function fs(A,V,j){V.isScene!==!0&&(V=In);let Z=He.get(A),J=C.state.lights,Ee=C.state.shadowsArray,De=J.state.version,Ae=oe.getParameters(A,J.state,Ee,V,j,C.state.lightProbeGridArray),Ue=oe.getProgramCacheKey(Ae),Ge=Z.programs;Z.environment=A.isMeshStandardMaterial||A.isMeshLambertMaterial||A.isMeshPhongMaterial?V.environment:null,Z.fog=V.fog;let nt=A.isMeshStandardMaterial||A.isMeshLambertMaterial&&!A.envMap||A.isMeshPhongMaterial&&!A.envMap;Z.envMap=I.get(A.envMap||Z.environment,nt),Z.envMapRotation=Z.environment!==null&&A.envMap===null?V.environmentRotation:A.envMapRotation,Ge===void 0&&(A.addEventListener("dispose",dt),Ge=new Map,Z.programs=Ge,Z.programVariants=new Map);let _t=Ge.get(Ue);if(_t!==void 0){if(Z.currentProgram===_t&&Z.lightsStateVersion===De)return va(A,Ae),_t}else Ae.uniforms=oe.getUniforms(A),z!==null&&A.isNodeMaterial&&z.build(A,j,Ae),A.onBeforeCompile(Ae,P),_t=oe.acquireProgram(Ae,Ue),Ge.set(Ue,_t),Z.uniforms=Ae.uniforms;let Ve=Z.uniforms;return(!A.isShaderMaterial&&!A.isRawShaderMaterial||A.clipping===!0)&&(Ve.clippingPlanes=se.uniform),va(A,Ae),Z.needsLights=js(A),Z.lightsStateVersion=De,Z.needsLights&&(Ve.ambientLightColor.value=J.state.ambient,Ve.lightProbe.value=J.state.probe,Ve.sunLights.value=J.state.sun,Ve.sunLightShadows.value=J.state.sunShadow,Ve.directionalLights.value=J.state.directional,Ve.directionalLightShadows.value=J.state.directionalShadow,Ve.spotLights.value=J.state.spot,Ve.spotLightShadows.value=J.state.spotShadow,Ve.rectAreaLights.value=J.state.rectArea,Ve.ltc_1.value=J.state.rectAreaLTC1,Ve.ltc_2.value=J.state.rectAreaLTC2,Ve.pointLights.value=J.state.point,Ve.pointLightShadows.value=J.state.pointShadow,Ve.hemisphereLights.value=J.state.hemi,Ve.sunShadowMatrix.value=J.state.sunShadowMatrix,Ve.sunShadowCascade.value=J.state.sunShadowCascade,Ve.directionalShadowMatrix.value=J.state.directionalShadowMatrix,Ve.spotLightMatrix.value=J.state.spotLightMatrix,Ve.spotLightMap.value=J.state.spotLightMap,Ve.pointShadowMatrix.value=J.state.pointShadowMatrix),Z.numLightProbeGrids=_n(C.state.lightProbeGridArray),Z.currentProgram=_t,Z.uniformsList=null,_t}function Si(A,V,j,Z,J){let Ee=He.get(A),De=Ee.currentProgram.id+","+Z+","+J,Ae=Ee.programVariants.get(De);return Ae===void 0?(Ae=fs(A,V,j),Ee.programVariants.set(De,Ae)):(Ee.currentProgram=Ae,Ee.uniformsList=null,Ee.outputColorSpace=Z,Ee.toneMapping=J),Ae}function Ks(A){if(A.uniformsList===null){let V=A.currentProgram.getUniforms();A.uniformsList=ea.seqWithValue(V.seq,A.uniforms)}return A.uniformsList}function va(A,V){let j=He.get(A);j.outputColorSpace=V.outputColorSpace,j.batching=V.batching,j.batchingColor=V.batchingColor,j.instancing=V.instancing,j.instancingColor=V.instancingColor,j.instancingMorph=V.instancingMorph,j.skinning=V.skinning,j.morphTargets=V.morphTargets,j.morphNormals=V.morphNormals,j.morphColors=V.morphColors,j.morphTargetsCount=V.morphTargetsCount,j.numClippingPlanes=V.numClippingPlanes,j.numIntersection=V.numClipIntersection,j.vertexAlphas=V.vertexAlphas,j.vertexTangents=V.vertexTangents,j.toneMapping=V.toneMapping}function xa(A,V,j,Z,J){V.isScene!==!0&&(V=In),Ze.resetTextureUnits();let Ee=V.fog,De=Z.isMeshStandardMaterial||Z.isMeshLambertMaterial||Z.isMeshPhongMaterial?V.environment:null,Ae=le===null?P.outputColorSpace:le.isXRRenderTarget===!0?le.texture.colorSpace:St.workingColorSpace,Ue=Z.isMeshStandardMaterial||Z.isMeshLambertMaterial&&!Z.envMap||Z.isMeshPhongMaterial&&!Z.envMap,Ge=I.get(Z.envMap||De,Ue),nt=Z.vertexColors===!0&&!!j.attributes.color&&j.attributes.color.itemSize===4,_t=!!j.attributes.tangent&&(!!Z.normalMap||Z.anisotropy>0),Ve=!!j.morphAttributes.position,vt=!!j.morphAttributes.normal,an=!!j.morphAttributes.color,Ot=Ss;Z.toneMapped&&(le===null||le.isXRRenderTarget===!0)&&(Ot=P.toneMapping);let Ft=j.morphAttributes.position||j.morphAttributes.normal||j.morphAttributes.color,Ln=Ft!==void 0?Ft.length:0,ke=He.get(Z),Sn=C.state.lights;if(Yt===!0&&(yn===!0||A!==Q)){let kt=A===Q&&Z.id===Y;se.setState(Z,A,kt)}let bt=!1,Ls=!1;Z.version===ke.__version?ke.needsLights&&ke.lightsStateVersion!==Sn.state.version||J.isBatchedMesh&&ke.batching===!1||!J.isBatchedMesh&&ke.batching===!0||J.isBatchedMesh&&ke.batchingColor===!0&&J._colorsTexture===null||J.isBatchedMesh&&ke.batchingColor===!1&&J._colorsTexture!==null||J.isInstancedMesh&&ke.instancing===!1||!J.isInstancedMesh&&ke.instancing===!0||J.isSkinnedMesh&&ke.skinning===!1||!J.isSkinnedMesh&&ke.skinning===!0||J.isInstancedMesh&&ke.instancingColor===!0&&J.instanceColor===null||J.isInstancedMesh&&ke.instancingColor===!1&&J.instanceColor!==null||J.isInstancedMesh&&ke.instancingMorph===!0&&J.morphTexture===null||J.isInstancedMesh&&ke.instancingMorph===!1&&J.morphTexture!==null||ke.envMap!==Ge||Z.fog===!0&&ke.fog!==Ee||ke.numClippingPlanes!==void 0&&(ke.numClippingPlanes!==se.numPlanes||ke.numIntersection!==se.numIntersection)||ke.vertexAlphas!==nt||ke.vertexTangents!==_t||ke.morphTargets!==Ve||ke.morphNormals!==vt||ke.morphColors!==an||ke.morphTargetsCount!==Ln||ke.numLightProbeGrids!==_n(C.state.lightProbeGridArray)?bt=!0:(ke.outputColorSpace!==Ae||ke.toneMapping!==Ot)&&(Ls=!0):(bt=!0,ke.__version=Z.version);let Mn=ke.currentProgram;(bt===!0||Ls===!0)&&(Mn=Ls===!0?Si(Z,V,J,Ae,Ot):fs(Z,V,J),z&&Z.isNodeMaterial&&z.onUpdateProgram(Z,Mn,ke));let so=!1,ps=!1,Ds=!1,pt=Mn.getUniforms(),hn=ke.uniforms;if(we.useProgram(Mn.program)&&(so=!0,ps=!0,Ds=!0),Z.id!==Y&&(Y=Z.id,ps=!0),so||Q!==A){we.buffers.depth.getReversed()&&A.reversedDepth!==!0&&(A._reversedDepth=!0,A.updateProjectionMatrix()),pt.setValue(B,"projectionMatrix",A.projectionMatrix),pt.setValue(B,"viewMatrix",A.matrixWorldInverse);let wn=pt.map.cameraPosition;wn!==void 0&&wn.setValue(B,Bn.setFromMatrixPosition(A.matrixWorld)),ct.logarithmicDepthBuffer&&pt.setValue(B,"logDepthBufFC",2/(Math.log(A.far+1)/Math.LN2)),(Z.isMeshPhongMaterial||Z.isMeshToonMaterial||Z.isMeshLambertMaterial||Z.isMeshBasicMaterial||Z.isMeshStandardMaterial||Z.isShaderMaterial)&&pt.setValue(B,"isOrthographic",A.isOrthographicCamera===!0),Q!==A&&(Q=A,ps=!0,Ds=!0)}if(ke.needsLights&&(Sn.state.sunShadowMap.length>0&&pt.setValue(B,"sunShadowMap",Sn.state.sunShadowMap,Ze),Sn.state.directionalShadowMap.length>0&&pt.setValue(B,"directionalShadowMap",Sn.state.directionalShadowMap,Ze),Sn.state.spotShadowMap.length>0&&pt.setValue(B,"spotShadowMap",Sn.state.spotShadowMap,Ze),Sn.state.pointShadowMap.length>0&&pt.setValue(B,"pointShadowMap",Sn.state.pointShadowMap,Ze)),J.isSkinnedMesh){pt.setOptional(B,J,"bindMatrix"),pt.setOptional(B,J,"bindMatrixInverse");let kt=J.skeleton;kt&&(kt.boneTexture===null&&kt.computeBoneTexture(),pt.setValue(B,"boneTexture",kt.boneTexture,Ze))}J.isBatchedMesh&&(pt.setOptional(B,J,"batchingTexture"),pt.setValue(B,"batchingTexture",J._matricesTexture,Ze),pt.setOptional(B,J,"batchingIdTexture"),pt.setValue(B,"batchingIdTexture",J._indirectTexture,Ze),pt.setOptional(B,J,"batchingColorTexture"),J._colorsTexture!==null&&pt.setValue(B,"batchingColorTexture",J._colorsTexture,Ze));let si=j.morphAttributes;if((si.position!==void 0||si.normal!==void 0||si.color!==void 0)&&re.update(J,j,Mn),(ps||ke.receiveShadow!==J.receiveShadow)&&(ke.receiveShadow=J.receiveShadow,pt.setValue(B,"receiveShadow",J.receiveShadow)),(Z.isMeshStandardMaterial||Z.isMeshLambertMaterial||Z.isMeshPhongMaterial)&&Z.envMap===null&&V.environment!==null&&(hn.envMapIntensity.value=V.environmentIntensity),hn.dfgLUT!==void 0&&(hn.dfgLUT.value=NT()),ps){if(pt.setValue(B,"toneMappingExposure",P.toneMappingExposure),ke.needsLights&&no(hn,Ds),Ee&&Z.fog===!0&&ve.refreshFogUniforms(hn,Ee),ve.refreshMaterialUniforms(hn,Z,Me,Re,C.state.transmissionRenderTarget[A.id]),ke.needsLights&&ke.numLightProbeGrids>0){let kt=S,wn=0;for(let Qn of C.state.lightProbeGridArray)Qn.texture!==null&&(kt.textures[wn]=Qn.texture,kt.min[wn]=Qn.boundingBox.min,kt.max[wn]=Qn.boundingBox.max,kt.resolution[wn]=Qn.resolution,wn++);for(let Qn in kt)kt[Qn].length=wn;hn.probesSH.value=kt.textures,hn.probesMin.value=kt.min,hn.probesMax.value=kt.max,hn.probesResolution.value=kt.resolution}ea.upload(B,Ks(ke),hn,Ze)}if(Z.isShaderMaterial&&Z.uniformsNeedUpdate===!0&&(ea.upload(B,Ks(ke),hn,Ze),Z.uniformsNeedUpdate=!1),Z.isSpriteMaterial&&pt.setValue(B,"center",J.center),pt.setValue(B,"modelViewMatrix",J.modelViewMatrix),pt.setValue(B,"normalMatrix",J.normalMatrix),pt.setValue(B,"modelMatrix",J.matrixWorld),Z.uniformsGroups!==void 0){let kt=Z.uniformsGroups;for(let wn=0,Qn=kt.length;wn<Qn;wn++){let Hl=kt[wn];qe.update(Hl,Mn),qe.bind(Hl,Mn)}}return Mn}function no(A,V){A.ambientLightColor.needsUpdate=V,A.lightProbe.needsUpdate=V,A.sunLights.needsUpdate=V,A.sunLightShadows.needsUpdate=V,A.directionalLights.needsUpdate=V,A.directionalLightShadows.needsUpdate=V,A.pointLights.needsUpdate=V,A.pointLightShadows.needsUpdate=V,A.spotLights.needsUpdate=V,A.spotLightShadows.needsUpdate=V,A.rectAreaLights.needsUpdate=V,A.hemisphereLights.needsUpdate=V}function js(A){return A.isMeshLambertMaterial||A.isMeshToonMaterial||A.isMeshPhongMaterial||A.isMeshStandardMaterial||A.isShadowMaterial||A.isShaderMaterial&&A.lights===!0}this.getActiveCubeFace=function(){return $},this.getActiveMipmapLevel=function(){return H},this.getRenderTarget=function(){return le},this.setRenderTargetTextures=function(A,V,j){let Z=He.get(A);Z.__autoAllocateDepthBuffer=A.resolveDepthBuffer===!1,Z.__autoAllocateDepthBuffer===!1&&(Z.__useRenderToTexture=!1),He.get(A.texture).__webglTexture=V,He.get(A.depthTexture).__webglTexture=Z.__autoAllocateDepthBuffer?void 0:j,Z.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(A,V){let j=He.get(A);j.__webglFramebuffer=V,j.__useDefaultFramebuffer=V===void 0},this.setRenderTarget=function(A,V=0,j=0){le=A,$=V,H=j;let Z=null,J=!1,Ee=!1;if(A){let Ae=He.get(A);if(Ae.__useDefaultFramebuffer!==void 0){we.bindFramebuffer(B.FRAMEBUFFER,Ae.__webglFramebuffer),ie.copy(A.viewport),he.copy(A.scissor),de=A.scissorTest,we.viewport(ie),we.scissor(he),we.setScissorTest(de),Y=-1;return}else if(Ae.__webglFramebuffer===void 0)Ze.setupRenderTarget(A);else if(Ae.__hasExternalTextures)Ze.rebindTextures(A,He.get(A.texture).__webglTexture,He.get(A.depthTexture).__webglTexture);else if(A.depthBuffer){let nt=A.depthTexture;if(Ae.__boundDepthTexture!==nt){if(nt!==null&&He.has(nt)&&(A.width!==nt.image.width||A.height!==nt.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");Ze.setupDepthRenderbuffer(A)}}let Ue=A.texture;(Ue.isData3DTexture||Ue.isDataArrayTexture||Ue.isCompressedArrayTexture)&&(Ee=!0);let Ge=He.get(A).__webglFramebuffer;A.isWebGLCubeRenderTarget?(Array.isArray(Ge[V])?Z=Ge[V][j]:Z=Ge[V],J=!0):A.samples>0&&Ze.useMultisampledRTT(A)===!1?Z=He.get(A).__webglMultisampledFramebuffer:Array.isArray(Ge)?Z=Ge[j]:Z=Ge,ie.copy(A.viewport),he.copy(A.scissor),de=A.scissorTest}else ie.copy(We).multiplyScalar(Me).floor(),he.copy(gt).multiplyScalar(Me).floor(),de=ft;if(j!==0&&(Z=G),we.bindFramebuffer(B.FRAMEBUFFER,Z)&&we.drawBuffers(A,Z),we.viewport(ie),we.scissor(he),we.setScissorTest(de),J){let Ae=He.get(A.texture);B.framebufferTexture2D(B.FRAMEBUFFER,B.COLOR_ATTACHMENT0,B.TEXTURE_CUBE_MAP_POSITIVE_X+V,Ae.__webglTexture,j)}else if(Ee){let Ae=V;for(let Ue=0;Ue<A.textures.length;Ue++){let Ge=He.get(A.textures[Ue]);B.framebufferTextureLayer(B.FRAMEBUFFER,B.COLOR_ATTACHMENT0+Ue,Ge.__webglTexture,j,Ae)}}else if(A!==null&&j!==0){let Ae=He.get(A.texture);B.framebufferTexture2D(B.FRAMEBUFFER,B.COLOR_ATTACHMENT0,B.TEXTURE_2D,Ae.__webglTexture,j)}Y=-1};function io(A){let V=He.get(A);return(V.__readFormat!==A.format||V.__readType!==A.type)&&(V.__readFormat=A.format,V.__readType=A.type,V.__formatReadable=ct.textureFormatReadable(A.format),V.__typeReadable=ct.textureTypeReadable(A.type)),V}this.readRenderTargetPixels=function(A,V,j,Z,J,Ee,De,Ae=0){if(!(A&&A.isWebGLRenderTarget)){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let Ue=He.get(A).__webglFramebuffer;if(A.isWebGLCubeRenderTarget&&De!==void 0&&(Ue=Ue[De],Array.isArray(Ue)&&(Ue=Ue[0])),Ue){we.bindFramebuffer(B.FRAMEBUFFER,Ue);try{let Ge=A.textures[Ae],nt=Ge.format,_t=Ge.type;A.textures.length>1&&B.readBuffer(B.COLOR_ATTACHMENT0+Ae);let Ve=io(Ge);if(Ve.__formatReadable===!1){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(Ve.__typeReadable===!1){Qe("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}V>=0&&V<=A.width-Z&&j>=0&&j<=A.height-J&&B.readPixels(V,j,Z,J,_e.convert(nt),_e.convert(_t),Ee)}finally{let Ge=le!==null?He.get(le).__webglFramebuffer:null;we.bindFramebuffer(B.FRAMEBUFFER,Ge)}}},this.readRenderTargetPixelsAsync=async function(A,V,j,Z,J,Ee,De,Ae=0){if(!(A&&A.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let Ue=He.get(A).__webglFramebuffer;if(A.isWebGLCubeRenderTarget&&De!==void 0&&(Ue=Ue[De],Array.isArray(Ue)&&(Ue=Ue[0])),Ue)if(V>=0&&V<=A.width-Z&&j>=0&&j<=A.height-J){we.bindFramebuffer(B.FRAMEBUFFER,Ue);let Ge=A.textures[Ae],nt=Ge.format,_t=Ge.type;A.textures.length>1&&B.readBuffer(B.COLOR_ATTACHMENT0+Ae);let Ve=io(Ge);if(Ve.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(Ve.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");let vt=B.createBuffer();B.bindBuffer(B.PIXEL_PACK_BUFFER,vt),B.bufferData(B.PIXEL_PACK_BUFFER,Ee.byteLength,B.STREAM_READ),B.readPixels(V,j,Z,J,_e.convert(nt),_e.convert(_t),0),B.bindBuffer(B.PIXEL_PACK_BUFFER,null);let an=le!==null?He.get(le).__webglFramebuffer:null;we.bindFramebuffer(B.FRAMEBUFFER,an);let Ot=B.fenceSync(B.SYNC_GPU_COMMANDS_COMPLETE,0);return B.flush(),await z_(B,Ot,4),B.bindBuffer(B.PIXEL_PACK_BUFFER,vt),B.getBufferSubData(B.PIXEL_PACK_BUFFER,0,Ee),B.bindBuffer(B.PIXEL_PACK_BUFFER,null),B.deleteBuffer(vt),B.deleteSync(Ot),Ee}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(A,V=null,j=0){let Z=Math.pow(2,-j),J=Math.floor(A.image.width*Z),Ee=Math.floor(A.image.height*Z),De=V!==null?V.x:0,Ae=V!==null?V.y:0;Ze.setTexture2D(A,0),B.copyTexSubImage2D(B.TEXTURE_2D,j,0,0,De,Ae,J,Ee),we.unbindTexture()},this.copyTextureToTexture=function(A,V,j=null,Z=null,J=0,Ee=0){let De,Ae,Ue,Ge,nt,_t,Ve,vt,an,Ot=A.isCompressedTexture?A.mipmaps[Ee]:A.image;if(j!==null)De=j.max.x-j.min.x,Ae=j.max.y-j.min.y,Ue=j.isBox3?j.max.z-j.min.z:1,Ge=j.min.x,nt=j.min.y,_t=j.isBox3?j.min.z:0;else{let pt=Math.pow(2,-J);De=Math.floor(Ot.width*pt),Ae=Math.floor(Ot.height*pt),A.isDataArrayTexture?Ue=Ot.depth:A.isData3DTexture?Ue=Math.floor(Ot.depth*pt):Ue=1,Ge=0,nt=0,_t=0}Z!==null?(Ve=Z.x,vt=Z.y,an=Z.z):(Ve=0,vt=0,an=0);let Ft=_e.convert(V.format),Ln=_e.convert(V.type),ke;V.isData3DTexture?(Ze.setTexture3D(V,0),ke=B.TEXTURE_3D):V.isDataArrayTexture||V.isCompressedArrayTexture?(Ze.setTexture2DArray(V,0),ke=B.TEXTURE_2D_ARRAY):(Ze.setTexture2D(V,0),ke=B.TEXTURE_2D),we.activeTexture(B.TEXTURE0),we.pixelStorei(B.UNPACK_FLIP_Y_WEBGL,V.flipY),we.pixelStorei(B.UNPACK_PREMULTIPLY_ALPHA_WEBGL,V.premultiplyAlpha),we.pixelStorei(B.UNPACK_ALIGNMENT,V.unpackAlignment);let Sn=we.getParameter(B.UNPACK_ROW_LENGTH),bt=we.getParameter(B.UNPACK_IMAGE_HEIGHT),Ls=we.getParameter(B.UNPACK_SKIP_PIXELS),Mn=we.getParameter(B.UNPACK_SKIP_ROWS),so=we.getParameter(B.UNPACK_SKIP_IMAGES);we.pixelStorei(B.UNPACK_ROW_LENGTH,Ot.width),we.pixelStorei(B.UNPACK_IMAGE_HEIGHT,Ot.height),we.pixelStorei(B.UNPACK_SKIP_PIXELS,Ge),we.pixelStorei(B.UNPACK_SKIP_ROWS,nt),we.pixelStorei(B.UNPACK_SKIP_IMAGES,_t);let ps=A.isDataArrayTexture||A.isData3DTexture,Ds=V.isDataArrayTexture||V.isData3DTexture;if(A.isDepthTexture){let pt=He.get(A),hn=He.get(V),si=He.get(pt.__renderTarget),kt=He.get(hn.__renderTarget);we.bindFramebuffer(B.READ_FRAMEBUFFER,si.__webglFramebuffer),we.bindFramebuffer(B.DRAW_FRAMEBUFFER,kt.__webglFramebuffer);for(let wn=0;wn<Ue;wn++)ps&&(B.framebufferTextureLayer(B.READ_FRAMEBUFFER,B.COLOR_ATTACHMENT0,He.get(A).__webglTexture,J,_t+wn),B.framebufferTextureLayer(B.DRAW_FRAMEBUFFER,B.COLOR_ATTACHMENT0,He.get(V).__webglTexture,Ee,an+wn)),B.blitFramebuffer(Ge,nt,Ge+De,nt+Ae,Ve,vt,Ve+De,vt+Ae,B.DEPTH_BUFFER_BIT,B.NEAREST);we.bindFramebuffer(B.READ_FRAMEBUFFER,null),we.bindFramebuffer(B.DRAW_FRAMEBUFFER,null)}else if(J!==0||A.isRenderTargetTexture||He.has(A)){let pt=He.get(A),hn=He.get(V);we.bindFramebuffer(B.READ_FRAMEBUFFER,U),we.bindFramebuffer(B.DRAW_FRAMEBUFFER,W);for(let si=0;si<Ue;si++)ps?B.framebufferTextureLayer(B.READ_FRAMEBUFFER,B.COLOR_ATTACHMENT0,pt.__webglTexture,J,_t+si):B.framebufferTexture2D(B.READ_FRAMEBUFFER,B.COLOR_ATTACHMENT0,B.TEXTURE_2D,pt.__webglTexture,J),Ds?B.framebufferTextureLayer(B.DRAW_FRAMEBUFFER,B.COLOR_ATTACHMENT0,hn.__webglTexture,Ee,an+si):B.framebufferTexture2D(B.DRAW_FRAMEBUFFER,B.COLOR_ATTACHMENT0,B.TEXTURE_2D,hn.__webglTexture,Ee),J!==0?B.blitFramebuffer(Ge,nt,Ge+De,nt+Ae,Ve,vt,Ve+De,vt+Ae,B.COLOR_BUFFER_BIT,B.NEAREST):Ds?B.copyTexSubImage3D(ke,Ee,Ve,vt,an+si,Ge,nt,De,Ae):B.copyTexSubImage2D(ke,Ee,Ve,vt,Ge,nt,De,Ae);we.bindFramebuffer(B.READ_FRAMEBUFFER,null),we.bindFramebuffer(B.DRAW_FRAMEBUFFER,null)}else Ds?A.isDataTexture||A.isData3DTexture?B.texSubImage3D(ke,Ee,Ve,vt,an,De,Ae,Ue,Ft,Ln,Ot.data):V.isCompressedArrayTexture?B.compressedTexSubImage3D(ke,Ee,Ve,vt,an,De,Ae,Ue,Ft,Ot.data):B.texSubImage3D(ke,Ee,Ve,vt,an,De,Ae,Ue,Ft,Ln,Ot):A.isDataTexture?B.texSubImage2D(B.TEXTURE_2D,Ee,Ve,vt,De,Ae,Ft,Ln,Ot.data):A.isCompressedTexture?B.compressedTexSubImage2D(B.TEXTURE_2D,Ee,Ve,vt,Ot.width,Ot.height,Ft,Ot.data):B.texSubImage2D(B.TEXTURE_2D,Ee,Ve,vt,De,Ae,Ft,Ln,Ot);we.pixelStorei(B.UNPACK_ROW_LENGTH,Sn),we.pixelStorei(B.UNPACK_IMAGE_HEIGHT,bt),we.pixelStorei(B.UNPACK_SKIP_PIXELS,Ls),we.pixelStorei(B.UNPACK_SKIP_ROWS,Mn),we.pixelStorei(B.UNPACK_SKIP_IMAGES,so),Ee===0&&V.generateMipmaps===!0&&V.mipmapsAutoUpdate===!0&&B.generateMipmap(ke),we.unbindTexture()},this.initRenderTarget=function(A){He.get(A).__webglFramebuffer===void 0&&Ze.setupRenderTarget(A)},this.initTexture=function(A){A.isCubeTexture?Ze.setTextureCube(A,0):A.isData3DTexture?Ze.setTexture3D(A,0):A.isDataArrayTexture||A.isCompressedArrayTexture?Ze.setTexture2DArray(A,0):Ze.setTexture2D(A,0),we.unbindTexture()},this.resetState=function(){$=0,H=0,le=null,we.reset(),Se.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return zi}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(e){this._outputColorSpace=e;let t=this.getContext();t.drawingBufferColorSpace=St._getDrawingBufferColorSpace(e),t.unpackColorSpace=St._getUnpackColorSpace()}};var w0={type:"change"},fp={type:"start"},E0={type:"end"},mh=new Gs,T0=new Ci,UT=Math.cos(70*wl.DEG2RAD),On=new O,bi=2*Math.PI,It={NONE:-1,ROTATE:0,DOLLY:1,PAN:2,TOUCH_ROTATE:3,TOUCH_PAN:4,TOUCH_DOLLY_PAN:5,TOUCH_DOLLY_ROTATE:6},dp=1e-6,gh=class extends zr{constructor(e,t=null){super(e,t),this.state=It.NONE,this.target=new O,this.cursor=new O,this.minDistance=0,this.maxDistance=1/0,this.minZoom=0,this.maxZoom=1/0,this.minTargetRadius=0,this.maxTargetRadius=1/0,this.minPolarAngle=0,this.maxPolarAngle=Math.PI,this.minAzimuthAngle=-1/0,this.maxAzimuthAngle=1/0,this.enableDamping=!1,this.dampingFactor=.05,this.enableZoom=!0,this.zoomSpeed=1,this.enableRotate=!0,this.rotateSpeed=1,this.keyRotateSpeed=1,this.enablePan=!0,this.panSpeed=1,this.screenSpacePanning=!0,this.keyPanSpeed=7,this.zoomToCursor=!1,this.autoRotate=!1,this.autoRotateSpeed=2,this.keys={LEFT:"ArrowLeft",UP:"ArrowUp",RIGHT:"ArrowRight",BOTTOM:"ArrowDown"},this.mouseButtons={LEFT:_r.ROTATE,MIDDLE:_r.DOLLY,RIGHT:_r.PAN},this.touches={ONE:vr.ROTATE,TWO:vr.DOLLY_PAN},this.target0=this.target.clone(),this.position0=this.object.position.clone(),this.zoom0=this.object.zoom,this._cursorStyle="auto",this._domElementKeyEvents=null,this._lastPosition=new O,this._lastQuaternion=new zt,this._lastTargetPosition=new O,this._quat=new zt().setFromUnitVectors(e.up,new O(0,1,0)),this._quatInverse=this._quat.clone().invert(),this._spherical=new $o,this._sphericalDelta=new $o,this._scale=1,this._panOffset=new O,this._rotateStart=new Xe,this._rotateEnd=new Xe,this._rotateDelta=new Xe,this._panStart=new Xe,this._panEnd=new Xe,this._panDelta=new Xe,this._dollyStart=new Xe,this._dollyEnd=new Xe,this._dollyDelta=new Xe,this._dollyDirection=new O,this._mouse=new Xe,this._performCursorZoom=!1,this._pointers=[],this._pointerPositions={},this._controlActive=!1,this._onPointerMove=FT.bind(this),this._onPointerDown=OT.bind(this),this._onPointerUp=kT.bind(this),this._onContextMenu=XT.bind(this),this._onMouseWheel=VT.bind(this),this._onKeyDown=GT.bind(this),this._onTouchStart=HT.bind(this),this._onTouchMove=WT.bind(this),this._onMouseDown=BT.bind(this),this._onMouseMove=zT.bind(this),this._interceptControlDown=qT.bind(this),this._interceptControlUp=YT.bind(this),this.domElement!==null&&this.connect(this.domElement),this.update()}set cursorStyle(e){this._cursorStyle=e,e==="grab"?this.domElement.style.cursor="grab":this.domElement.style.cursor="auto"}get cursorStyle(){return this._cursorStyle}connect(e){super.connect(e),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointercancel",this._onPointerUp),this.domElement.addEventListener("contextmenu",this._onContextMenu),this.domElement.addEventListener("wheel",this._onMouseWheel,{passive:!1}),this.domElement.ownerDocument.addEventListener("keydown",this._interceptControlDown,{passive:!0,capture:!0}),this.domElement.style.touchAction="none"}disconnect(){this.state=It.NONE,this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.domElement.removeEventListener("pointercancel",this._onPointerUp),this.domElement.removeEventListener("wheel",this._onMouseWheel),this.domElement.removeEventListener("contextmenu",this._onContextMenu),this.stopListenToKeyEvents(),this.domElement.ownerDocument.removeEventListener("keydown",this._interceptControlDown,{capture:!0}),this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{capture:!0}),this._controlActive=!1,this._pointers.length=0,this._pointerPositions={},this.domElement.style.touchAction="",this.domElement.style.cursor="auto"}dispose(){this.disconnect()}getPolarAngle(){return this._spherical.phi}getAzimuthalAngle(){return this._spherical.theta}getDistance(){return this.object.position.distanceTo(this.target)}listenToKeyEvents(e){e.addEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=e}stopListenToKeyEvents(){this._domElementKeyEvents!==null&&(this._domElementKeyEvents.removeEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=null)}saveState(){this.target0.copy(this.target),this.position0.copy(this.object.position),this.zoom0=this.object.zoom}reset(){this.target.copy(this.target0),this.object.position.copy(this.position0),this.object.zoom=this.zoom0,this.object.updateProjectionMatrix(),this.dispatchEvent(w0),this.update(),this.state=It.NONE}pan(e,t){this._pan(e,t),this.update()}dollyIn(e){this._dollyIn(e),this.update()}dollyOut(e){this._dollyOut(e),this.update()}rotateLeft(e){this._rotateLeft(e),this.update()}rotateUp(e){this._rotateUp(e),this.update()}update(e=null){let t=this.object.position;On.copy(t).sub(this.target),On.applyQuaternion(this._quat),this._spherical.setFromVector3(On),this.autoRotate&&this.state===It.NONE&&this._rotateLeft(this._getAutoRotationAngle(e)),this.enableDamping?(this._spherical.theta+=this._sphericalDelta.theta*this.dampingFactor,this._spherical.phi+=this._sphericalDelta.phi*this.dampingFactor):(this._spherical.theta+=this._sphericalDelta.theta,this._spherical.phi+=this._sphericalDelta.phi);let i=this.minAzimuthAngle,s=this.maxAzimuthAngle;isFinite(i)&&isFinite(s)&&(i<-Math.PI?i+=bi:i>Math.PI&&(i-=bi),s<-Math.PI?s+=bi:s>Math.PI&&(s-=bi),i<=s?this._spherical.theta=Math.max(i,Math.min(s,this._spherical.theta)):this._spherical.theta=this._spherical.theta>(i+s)/2?Math.max(i,this._spherical.theta):Math.min(s,this._spherical.theta)),this._spherical.phi=Math.max(this.minPolarAngle,Math.min(this.maxPolarAngle,this._spherical.phi)),this._spherical.makeSafe(),this.enableDamping===!0?this.target.addScaledVector(this._panOffset,this.dampingFactor):this.target.add(this._panOffset),this.target.sub(this.cursor),this.target.clampLength(this.minTargetRadius,this.maxTargetRadius),this.target.add(this.cursor);let r=!1;if(this.zoomToCursor&&this._performCursorZoom||this.object.isOrthographicCamera)this._spherical.radius=this._clampDistance(this._spherical.radius);else{let o=this._spherical.radius;this._spherical.radius=this._clampDistance(this._spherical.radius*this._scale),r=o!=this._spherical.radius}if(On.setFromSpherical(this._spherical),On.applyQuaternion(this._quatInverse),t.copy(this.target).add(On),this.object.lookAt(this.target),this.enableDamping===!0?(this._sphericalDelta.theta*=1-this.dampingFactor,this._sphericalDelta.phi*=1-this.dampingFactor,this._panOffset.multiplyScalar(1-this.dampingFactor)):(this._sphericalDelta.set(0,0,0),this._panOffset.set(0,0,0)),this.zoomToCursor&&this._performCursorZoom){let o=null;if(this.object.isPerspectiveCamera){let a=On.length();o=this._clampDistance(a*this._scale);let l=a-o;this.object.position.addScaledVector(this._dollyDirection,l),this.object.updateMatrixWorld(),r=!!l}else if(this.object.isOrthographicCamera){let a=new O(this._mouse.x,this._mouse.y,0);a.unproject(this.object);let l=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),this.object.updateProjectionMatrix(),r=l!==this.object.zoom;let c=new O(this._mouse.x,this._mouse.y,0);c.unproject(this.object),this.object.position.sub(c).add(a),this.object.updateMatrixWorld(),o=On.length()}else console.warn("WARNING: OrbitControls.js encountered an unknown camera type - zoom to cursor disabled."),this.zoomToCursor=!1;o!==null&&(this.screenSpacePanning?this.target.set(0,0,-1).transformDirection(this.object.matrix).multiplyScalar(o).add(this.object.position):(mh.origin.copy(this.object.position),mh.direction.set(0,0,-1).transformDirection(this.object.matrix),Math.abs(this.object.up.dot(mh.direction))<UT?this.object.lookAt(this.target):(T0.setFromNormalAndCoplanarPoint(this.object.up,this.target),mh.intersectPlane(T0,this.target))))}else if(this.object.isOrthographicCamera){let o=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),o!==this.object.zoom&&(this.object.updateProjectionMatrix(),r=!0)}return this._scale=1,this._performCursorZoom=!1,r||this._lastPosition.distanceToSquared(this.object.position)>dp||8*(1-this._lastQuaternion.dot(this.object.quaternion))>dp||this._lastTargetPosition.distanceToSquared(this.target)>dp?(this.dispatchEvent(w0),this._lastPosition.copy(this.object.position),this._lastQuaternion.copy(this.object.quaternion),this._lastTargetPosition.copy(this.target),!0):!1}_getAutoRotationAngle(e){return e!==null?bi/60*this.autoRotateSpeed*e:bi/60/60*this.autoRotateSpeed}_getZoomScale(e){let t=Math.abs(e*.01);return Math.pow(.95,this.zoomSpeed*t)}_rotateLeft(e){this._sphericalDelta.theta-=e}_rotateUp(e){this._sphericalDelta.phi-=e}_panLeft(e,t){On.setFromMatrixColumn(t,0),On.multiplyScalar(-e),this._panOffset.add(On)}_panUp(e,t){this.screenSpacePanning===!0?On.setFromMatrixColumn(t,1):(On.setFromMatrixColumn(t,0),On.crossVectors(this.object.up,On)),On.multiplyScalar(e),this._panOffset.add(On)}_pan(e,t){let i=this.domElement;if(this.object.isPerspectiveCamera){let s=this.object.position;On.copy(s).sub(this.target);let r=On.length();r*=Math.tan(this.object.fov/2*Math.PI/180),this._panLeft(2*e*r/i.clientHeight,this.object.matrix),this._panUp(2*t*r/i.clientHeight,this.object.matrix)}else this.object.isOrthographicCamera?(this._panLeft(e*(this.object.right-this.object.left)/this.object.zoom/i.clientWidth,this.object.matrix),this._panUp(t*(this.object.top-this.object.bottom)/this.object.zoom/i.clientHeight,this.object.matrix)):(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - pan disabled."),this.enablePan=!1)}_dollyOut(e){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale/=e:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_dollyIn(e){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale*=e:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_updateZoomParameters(e,t){if(!this.zoomToCursor)return;this._performCursorZoom=!0;let i=this.domElement.getBoundingClientRect(),s=e-i.left,r=t-i.top,o=i.width,a=i.height;this._mouse.x=s/o*2-1,this._mouse.y=-(r/a)*2+1,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()}_clampDistance(e){return Math.max(this.minDistance,Math.min(this.maxDistance,e))}_handleMouseDownRotate(e){this._rotateStart.set(e.clientX,e.clientY)}_handleMouseDownDolly(e){this._updateZoomParameters(e.clientX,e.clientY),this._dollyStart.set(e.clientX,e.clientY)}_handleMouseDownPan(e){this._panStart.set(e.clientX,e.clientY)}_handleMouseMoveRotate(e){this._rotateEnd.set(e.clientX,e.clientY),this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let t=this.domElement;this._rotateLeft(bi*this._rotateDelta.x/t.clientHeight),this._rotateUp(bi*this._rotateDelta.y/t.clientHeight),this._rotateStart.copy(this._rotateEnd),this.update()}_handleMouseMoveDolly(e){this._dollyEnd.set(e.clientX,e.clientY),this._dollyDelta.subVectors(this._dollyEnd,this._dollyStart),this._dollyDelta.y>0?this._dollyOut(this._getZoomScale(this._dollyDelta.y)):this._dollyDelta.y<0&&this._dollyIn(this._getZoomScale(this._dollyDelta.y)),this._dollyStart.copy(this._dollyEnd),this.zoomToCursor&&(this._performCursorZoom=!0,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()),this.update()}_handleMouseMovePan(e){this._panEnd.set(e.clientX,e.clientY),this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd),this.update()}_handleMouseWheel(e){this._updateZoomParameters(e.clientX,e.clientY),e.deltaY<0?this._dollyIn(this._getZoomScale(e.deltaY)):e.deltaY>0&&this._dollyOut(this._getZoomScale(e.deltaY)),this.update()}_handleKeyDown(e){let t=!1;switch(e.code){case this.keys.UP:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateUp(bi*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,this.keyPanSpeed),t=!0;break;case this.keys.BOTTOM:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateUp(-bi*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,-this.keyPanSpeed),t=!0;break;case this.keys.LEFT:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateLeft(bi*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(this.keyPanSpeed,0),t=!0;break;case this.keys.RIGHT:e.ctrlKey||e.metaKey||e.shiftKey?this.enableRotate&&this._rotateLeft(-bi*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(-this.keyPanSpeed,0),t=!0;break}t&&(e.preventDefault(),this.update())}_handleTouchStartRotate(e){if(this._pointers.length===1)this._rotateStart.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._rotateStart.set(i,s)}}_handleTouchStartPan(e){if(this._pointers.length===1)this._panStart.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._panStart.set(i,s)}}_handleTouchStartDolly(e){let t=this._getSecondPointerPosition(e),i=e.pageX-t.x,s=e.pageY-t.y,r=Math.sqrt(i*i+s*s);this._dollyStart.set(0,r)}_handleTouchStartDollyPan(e){this.enableZoom&&this._handleTouchStartDolly(e),this.enablePan&&this._handleTouchStartPan(e)}_handleTouchStartDollyRotate(e){this.enableZoom&&this._handleTouchStartDolly(e),this.enableRotate&&this._handleTouchStartRotate(e)}_handleTouchMoveRotate(e){if(this._pointers.length==1)this._rotateEnd.set(e.pageX,e.pageY);else{let i=this._getSecondPointerPosition(e),s=.5*(e.pageX+i.x),r=.5*(e.pageY+i.y);this._rotateEnd.set(s,r)}this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let t=this.domElement;this._rotateLeft(bi*this._rotateDelta.x/t.clientHeight),this._rotateUp(bi*this._rotateDelta.y/t.clientHeight),this._rotateStart.copy(this._rotateEnd)}_handleTouchMovePan(e){if(this._pointers.length===1)this._panEnd.set(e.pageX,e.pageY);else{let t=this._getSecondPointerPosition(e),i=.5*(e.pageX+t.x),s=.5*(e.pageY+t.y);this._panEnd.set(i,s)}this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd)}_handleTouchMoveDolly(e){let t=this._getSecondPointerPosition(e),i=e.pageX-t.x,s=e.pageY-t.y,r=Math.sqrt(i*i+s*s);this._dollyEnd.set(0,r),this._dollyDelta.set(0,Math.pow(this._dollyEnd.y/this._dollyStart.y,this.zoomSpeed)),this._dollyOut(this._dollyDelta.y),this._dollyStart.copy(this._dollyEnd);let o=(e.pageX+t.x)*.5,a=(e.pageY+t.y)*.5;this._updateZoomParameters(o,a)}_handleTouchMoveDollyPan(e){this.enableZoom&&this._handleTouchMoveDolly(e),this.enablePan&&this._handleTouchMovePan(e)}_handleTouchMoveDollyRotate(e){this.enableZoom&&this._handleTouchMoveDolly(e),this.enableRotate&&this._handleTouchMoveRotate(e)}_addPointer(e){this._pointers.push(e.pointerId)}_removePointer(e){delete this._pointerPositions[e.pointerId];for(let t=0;t<this._pointers.length;t++)if(this._pointers[t]==e.pointerId){this._pointers.splice(t,1);return}}_isTrackingPointer(e){for(let t=0;t<this._pointers.length;t++)if(this._pointers[t]==e.pointerId)return!0;return!1}_trackPointer(e){let t=this._pointerPositions[e.pointerId];t===void 0&&(t=new Xe,this._pointerPositions[e.pointerId]=t),t.set(e.pageX,e.pageY)}_getSecondPointerPosition(e){let t=e.pointerId===this._pointers[0]?this._pointers[1]:this._pointers[0];return this._pointerPositions[t]}_customWheelEvent(e){let t=e.deltaMode,i={clientX:e.clientX,clientY:e.clientY,deltaY:e.deltaY};switch(t){case 1:i.deltaY*=16;break;case 2:i.deltaY*=100;break}return e.ctrlKey&&!this._controlActive&&(i.deltaY*=10),i}};function OT(n){this.enabled!==!1&&(this._pointers.length===0&&(this.domElement.setPointerCapture(n.pointerId),this.domElement.ownerDocument.addEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.addEventListener("pointerup",this._onPointerUp)),!this._isTrackingPointer(n)&&(this._addPointer(n),n.pointerType==="touch"?this._onTouchStart(n):this._onMouseDown(n),this._cursorStyle==="grab"&&(this.domElement.style.cursor="grabbing")))}function FT(n){this.enabled!==!1&&(n.pointerType==="touch"?this._onTouchMove(n):this._onMouseMove(n))}function kT(n){switch(this._removePointer(n),this._pointers.length){case 0:this.domElement.releasePointerCapture(n.pointerId),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.dispatchEvent(E0),this.state=It.NONE,this._cursorStyle==="grab"&&(this.domElement.style.cursor="grab");break;case 1:let e=this._pointers[0],t=this._pointerPositions[e];this._onTouchStart({pointerId:e,pageX:t.x,pageY:t.y});break}}function BT(n){let e;switch(n.button){case 0:e=this.mouseButtons.LEFT;break;case 1:e=this.mouseButtons.MIDDLE;break;case 2:e=this.mouseButtons.RIGHT;break;default:e=-1}switch(e){case _r.DOLLY:if(this.enableZoom===!1)return;this._handleMouseDownDolly(n),this.state=It.DOLLY;break;case _r.ROTATE:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=It.PAN}else{if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=It.ROTATE}break;case _r.PAN:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=It.ROTATE}else{if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=It.PAN}break;default:this.state=It.NONE}this.state!==It.NONE&&this.dispatchEvent(fp)}function zT(n){switch(this.state){case It.ROTATE:if(this.enableRotate===!1)return;this._handleMouseMoveRotate(n);break;case It.DOLLY:if(this.enableZoom===!1)return;this._handleMouseMoveDolly(n);break;case It.PAN:if(this.enablePan===!1)return;this._handleMouseMovePan(n);break}}function VT(n){this.enabled===!1||this.enableZoom===!1||this.state!==It.NONE||(n.preventDefault(),this.dispatchEvent(fp),this._handleMouseWheel(this._customWheelEvent(n)),this.dispatchEvent(E0))}function GT(n){this.enabled!==!1&&this._handleKeyDown(n)}function HT(n){switch(this._trackPointer(n),this._pointers.length){case 1:switch(this.touches.ONE){case vr.ROTATE:if(this.enableRotate===!1){this.state=It.NONE;break}this._handleTouchStartRotate(n),this.state=It.TOUCH_ROTATE;break;case vr.PAN:if(this.enablePan===!1){this.state=It.NONE;break}this._handleTouchStartPan(n),this.state=It.TOUCH_PAN;break;default:this.state=It.NONE}break;case 2:switch(this.touches.TWO){case vr.DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchStartDollyPan(n),this.state=It.TOUCH_DOLLY_PAN;break;case vr.DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchStartDollyRotate(n),this.state=It.TOUCH_DOLLY_ROTATE;break;default:this.state=It.NONE}break;default:this.state=It.NONE}this.state!==It.NONE&&this.dispatchEvent(fp)}function WT(n){switch(this._trackPointer(n),this.state){case It.TOUCH_ROTATE:if(this.enableRotate===!1)return;this._handleTouchMoveRotate(n),this.update();break;case It.TOUCH_PAN:if(this.enablePan===!1)return;this._handleTouchMovePan(n),this.update();break;case It.TOUCH_DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchMoveDollyPan(n),this.update();break;case It.TOUCH_DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchMoveDollyRotate(n),this.update();break;default:this.state=It.NONE}}function XT(n){this.enabled!==!1&&n.preventDefault()}function qT(n){n.key==="Control"&&(this._controlActive=!0,this.domElement.ownerDocument.addEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function YT(n){n.key==="Control"&&(this._controlActive=!1,this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}var qr=new pl,mn=new O,Sr=new O,on=new zt,A0={X:new O(1,0,0),Y:new O(0,1,0),Z:new O(0,0,1)},pp={type:"change"},C0={type:"mouseDown",mode:null},R0={type:"mouseUp",mode:null},P0={type:"objectChange"},bh=class extends zr{constructor(e,t=null){super(void 0,t);let i=new gp(this);this._root=i;let s=new _p;this._gizmo=s,i.add(s);let r=new vp;this._plane=r,i.add(r);let o=this;function a(T,S){let R=S;Object.defineProperty(o,T,{get:function(){return R!==void 0?R:S},set:function(C){R!==C&&(R=C,r[T]=C,s[T]=C,o.dispatchEvent({type:T+"-changed",value:C}),o.dispatchEvent(pp))}}),o[T]=S,r[T]=S,s[T]=S}a("camera",e),a("object",void 0),a("enabled",!0),a("axis",null),a("mode","translate"),a("translationSnap",null),a("rotationSnap",null),a("scaleSnap",null),a("space","world"),a("size",1),this.viewport=null,a("dragging",!1),a("showX",!0),a("showY",!0),a("showZ",!0),a("showXY",!0),a("showYZ",!0),a("showXZ",!0),a("showXYZE",!0),a("showE",!0),a("minX",-1/0),a("maxX",1/0),a("minY",-1/0),a("maxY",1/0),a("minZ",-1/0),a("maxZ",1/0);let l=new O,c=new O,u=new zt,f=new zt,d=new O,p=new zt,g=new O,v=new O,m=new O,_=0,x=new O;a("worldPosition",l),a("worldPositionStart",c),a("worldQuaternion",u),a("worldQuaternionStart",f),a("cameraPosition",d),a("cameraQuaternion",p),a("pointStart",g),a("pointEnd",v),a("rotationAxis",m),a("rotationAngle",_),a("eye",x),this._offset=new O,this._startNorm=new O,this._endNorm=new O,this._cameraScale=new O,this._parentPosition=new O,this._parentQuaternion=new zt,this._parentQuaternionInv=new zt,this._parentScale=new O,this._worldScaleStart=new O,this._worldQuaternionInv=new zt,this._worldScale=new O,this._positionStart=new O,this._quaternionStart=new zt,this._scaleStart=new O,this._getPointer=$T.bind(this),this._onPointerDown=JT.bind(this),this._onPointerHover=ZT.bind(this),this._onPointerMove=KT.bind(this),this._onPointerUp=jT.bind(this),t!==null&&this.connect(t)}connect(e){super.connect(e),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointermove",this._onPointerHover),this.domElement.addEventListener("pointerup",this._onPointerUp),this.domElement.style.touchAction="none"}disconnect(){this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.removeEventListener("pointermove",this._onPointerHover),this.domElement.removeEventListener("pointermove",this._onPointerMove),this.domElement.removeEventListener("pointerup",this._onPointerUp),this.domElement.style.touchAction=""}getHelper(){return this._root}pointerHover(e){if(this.object===void 0||this.dragging===!0)return;e!==null&&qr.setFromCamera(e,this.camera);let t=mp(this._gizmo.picker[this.mode],qr);t?this.axis=t.object.name:this.axis=null}pointerDown(e){if(!(this.object===void 0||this.dragging===!0||e!=null&&e.button!==0)&&this.axis!==null){e!==null&&qr.setFromCamera(e,this.camera);let t=mp(this._plane,qr,!0);t&&(this.object.updateMatrixWorld(),this.object.parent.updateMatrixWorld(),this._positionStart.copy(this.object.position),this._quaternionStart.copy(this.object.quaternion),this._scaleStart.copy(this.object.scale),this.object.matrixWorld.decompose(this.worldPositionStart,this.worldQuaternionStart,this._worldScaleStart),this.pointStart.copy(t.point).sub(this.worldPositionStart)),this.dragging=!0,C0.mode=this.mode,this.dispatchEvent(C0)}}pointerMove(e){let t=this.axis,i=this.mode,s=this.object,r=this.space;if(i==="scale"?r="local":(t==="E"||t==="XYZE"||t==="XYZ")&&(r="world"),s===void 0||t===null||this.dragging===!1||e!==null&&e.button!==-1)return;e!==null&&qr.setFromCamera(e,this.camera);let o=mp(this._plane,qr,!0);if(o){if(this.pointEnd.copy(o.point).sub(this.worldPositionStart),i==="translate")this._offset.copy(this.pointEnd).sub(this.pointStart),r==="local"&&t!=="XYZ"&&this._offset.applyQuaternion(this._worldQuaternionInv),t.indexOf("X")===-1&&(this._offset.x=0),t.indexOf("Y")===-1&&(this._offset.y=0),t.indexOf("Z")===-1&&(this._offset.z=0),r==="local"&&t!=="XYZ"?this._offset.applyQuaternion(this._quaternionStart).divide(this._parentScale):this._offset.applyQuaternion(this._parentQuaternionInv).divide(this._parentScale),s.position.copy(this._offset).add(this._positionStart),this.translationSnap&&(r==="local"&&(s.position.applyQuaternion(on.copy(this._quaternionStart).invert()),t.search("X")!==-1&&(s.position.x=Math.round(s.position.x/this.translationSnap)*this.translationSnap),t.search("Y")!==-1&&(s.position.y=Math.round(s.position.y/this.translationSnap)*this.translationSnap),t.search("Z")!==-1&&(s.position.z=Math.round(s.position.z/this.translationSnap)*this.translationSnap),s.position.applyQuaternion(this._quaternionStart)),r==="world"&&(s.getWorldPosition(mn),t.search("X")!==-1&&(mn.x=Math.round(mn.x/this.translationSnap)*this.translationSnap),t.search("Y")!==-1&&(mn.y=Math.round(mn.y/this.translationSnap)*this.translationSnap),t.search("Z")!==-1&&(mn.z=Math.round(mn.z/this.translationSnap)*this.translationSnap),s.position.copy(s.parent.worldToLocal(mn)))),s.position.x=Math.max(this.minX,Math.min(this.maxX,s.position.x)),s.position.y=Math.max(this.minY,Math.min(this.maxY,s.position.y)),s.position.z=Math.max(this.minZ,Math.min(this.maxZ,s.position.z));else if(i==="scale"){if(t.search("XYZ")!==-1){let a=this.pointEnd.length()/this.pointStart.length();this.pointEnd.dot(this.pointStart)<0&&(a*=-1),Sr.set(a,a,a)}else mn.copy(this.pointStart),Sr.copy(this.pointEnd),mn.applyQuaternion(this._worldQuaternionInv),Sr.applyQuaternion(this._worldQuaternionInv),Sr.divide(mn),t.search("X")===-1&&(Sr.x=1),t.search("Y")===-1&&(Sr.y=1),t.search("Z")===-1&&(Sr.z=1);s.scale.copy(this._scaleStart).multiply(Sr),this.scaleSnap&&(t.search("X")!==-1&&(s.scale.x=Math.round(s.scale.x/this.scaleSnap)*this.scaleSnap||this.scaleSnap),t.search("Y")!==-1&&(s.scale.y=Math.round(s.scale.y/this.scaleSnap)*this.scaleSnap||this.scaleSnap),t.search("Z")!==-1&&(s.scale.z=Math.round(s.scale.z/this.scaleSnap)*this.scaleSnap||this.scaleSnap))}else if(i==="rotate"){this._offset.copy(this.pointEnd).sub(this.pointStart);let a=20/this.worldPosition.distanceTo(mn.setFromMatrixPosition(this.camera.matrixWorld)),l=!1;t==="XYZE"?(this.rotationAxis.copy(this._offset).cross(this.eye).normalize(),this.rotationAngle=this._offset.dot(mn.copy(this.rotationAxis).cross(this.eye))*a):(t==="X"||t==="Y"||t==="Z")&&(this.rotationAxis.copy(A0[t]),mn.copy(A0[t]),r==="local"&&mn.applyQuaternion(this.worldQuaternion),mn.cross(this.eye),mn.length()===0?l=!0:this.rotationAngle=this._offset.dot(mn.normalize())*a),(t==="E"||l)&&(this.rotationAxis.copy(this.eye),this.rotationAngle=this.pointEnd.angleTo(this.pointStart),this._startNorm.copy(this.pointStart).normalize(),this._endNorm.copy(this.pointEnd).normalize(),this.rotationAngle*=this._endNorm.cross(this._startNorm).dot(this.eye)<0?1:-1),this.rotationSnap&&(this.rotationAngle=Math.round(this.rotationAngle/this.rotationSnap)*this.rotationSnap),r==="local"&&t!=="E"&&t!=="XYZE"?(s.quaternion.copy(this._quaternionStart),s.quaternion.multiply(on.setFromAxisAngle(this.rotationAxis,this.rotationAngle)).normalize()):(this.rotationAxis.applyQuaternion(this._parentQuaternionInv),s.quaternion.copy(on.setFromAxisAngle(this.rotationAxis,this.rotationAngle)),s.quaternion.multiply(this._quaternionStart).normalize())}this.dispatchEvent(pp),this.dispatchEvent(P0)}}pointerUp(e){e!==null&&e.button!==0||(this.dragging&&this.axis!==null&&(R0.mode=this.mode,this.dispatchEvent(R0)),this.dragging=!1,this.axis=null)}dispose(){this.disconnect(),this._root.dispose()}attach(e){return this.object=e,this._root.visible=!0,this}detach(){return this.object=void 0,this.axis=null,this._root.visible=!1,this}reset(){this.enabled&&this.dragging&&(this.object.position.copy(this._positionStart),this.object.quaternion.copy(this._quaternionStart),this.object.scale.copy(this._scaleStart),this.dispatchEvent(pp),this.dispatchEvent(P0),this.pointStart.copy(this.pointEnd))}getRaycaster(){return qr}getMode(){return this.mode}setMode(e){this.mode=e}setTranslationSnap(e){this.translationSnap=e}setRotationSnap(e){this.rotationSnap=e}setScaleSnap(e){this.scaleSnap=e}setSize(e){this.size=e}setSpace(e){this.space=e}setColors(e,t,i,s){let r=this._gizmo.materialLib;r.xAxis.color.set(e),r.yAxis.color.set(t),r.zAxis.color.set(i),r.active.color.set(s),r.xAxisTransparent.color.set(e),r.yAxisTransparent.color.set(t),r.zAxisTransparent.color.set(i),r.activeTransparent.color.set(s),r.xAxis._color&&r.xAxis._color.set(e),r.yAxis._color&&r.yAxis._color.set(t),r.zAxis._color&&r.zAxis._color.set(i),r.active._color&&r.active._color.set(s),r.xAxisTransparent._color&&r.xAxisTransparent._color.set(e),r.yAxisTransparent._color&&r.yAxisTransparent._color.set(t),r.zAxisTransparent._color&&r.zAxisTransparent._color.set(i),r.activeTransparent._color&&r.activeTransparent._color.set(s)}};function $T(n){if(this.domElement.ownerDocument.pointerLockElement)return{x:0,y:0,button:n.button};{let e=this.domElement.getBoundingClientRect(),t=this.viewport,i,s,r,o;return t!==null?(i=t.x,s=e.height-t.y-t.w,r=t.z,o=t.w):(i=0,s=0,r=e.width,o=e.height),{x:(n.clientX-e.left-i)/r*2-1,y:-(n.clientY-e.top-s)/o*2+1,button:n.button}}}function ZT(n){if(this.enabled)switch(n.pointerType){case"mouse":case"pen":this.pointerHover(this._getPointer(n));break}}function JT(n){this.enabled&&(document.pointerLockElement||this.domElement.setPointerCapture(n.pointerId),this.domElement.addEventListener("pointermove",this._onPointerMove),this.pointerHover(this._getPointer(n)),this.pointerDown(this._getPointer(n)))}function KT(n){this.enabled&&this.pointerMove(this._getPointer(n))}function jT(n){this.enabled&&(this.domElement.releasePointerCapture(n.pointerId),this.domElement.removeEventListener("pointermove",this._onPointerMove),this.pointerUp(this._getPointer(n)))}function mp(n,e,t){let i=e.intersectObject(n,!0);for(let s=0;s<i.length;s++)if(i[s].object.visible||t)return i[s];return!1}var _h=new ts,Wt=new O(0,1,0),I0=new O(0,0,0),L0=new Et,vh=new zt,yh=new zt,ws=new O,Sh=new Et,Ll=new O(1,0,0),Yr=new O(0,1,0),Dl=new O(0,0,1),xh=new O,Pl=new O,Il=new O,gp=class extends ln{constructor(e){super(),this.isTransformControlsRoot=!0,this.controls=e,this.visible=!1}updateMatrixWorld(e){let t=this.controls;t.object!==void 0&&(t.object.updateMatrixWorld(),t.object.parent===null?console.error("TransformControls: The attached 3D object must be a part of the scene graph."):t.object.parent.matrixWorld.decompose(t._parentPosition,t._parentQuaternion,t._parentScale),t.object.matrixWorld.decompose(t.worldPosition,t.worldQuaternion,t._worldScale),t._parentQuaternionInv.copy(t._parentQuaternion).invert(),t._worldQuaternionInv.copy(t.worldQuaternion).invert()),t.camera.updateMatrixWorld(),t.camera.matrixWorld.decompose(t.cameraPosition,t.cameraQuaternion,t._cameraScale),t.camera.isOrthographicCamera?t.camera.getWorldDirection(t.eye).negate():t.eye.copy(t.cameraPosition).sub(t.worldPosition).normalize(),this.parent&&(Sh.copy(this.parent.matrixWorld).invert(),Sh.decompose(this.position,this.quaternion,this.scale)),super.updateMatrixWorld(e)}dispose(){this.traverse(function(e){e.geometry&&e.geometry.dispose(),e.material&&e.material.dispose()})}},_p=class extends ln{constructor(){super(),this.isTransformControlsGizmo=!0,this.type="TransformControlsGizmo";let e=new is({depthTest:!1,depthWrite:!1,fog:!1,toneMapped:!1,transparent:!0}),t=new _i({depthTest:!1,depthWrite:!1,fog:!1,toneMapped:!1,transparent:!0}),i=e.clone();i.opacity=.15;let s=t.clone();s.opacity=.5;let r=e.clone();r.color.setHex(16711680);let o=e.clone();o.color.setHex(65280);let a=e.clone();a.color.setHex(255);let l=e.clone();l.color.setHex(16711680),l.opacity=.5;let c=e.clone();c.color.setHex(65280),c.opacity=.5;let u=e.clone();u.color.setHex(255),u.opacity=.5;let f=e.clone();f.opacity=.25;let d=e.clone();d.color.setHex(16776960),d.opacity=.25;let p=e.clone();p.color.setHex(16776960);let g=e.clone();g.color.setHex(7895160),this.materialLib={xAxis:r,yAxis:o,zAxis:a,active:p,xAxisTransparent:l,yAxisTransparent:c,zAxisTransparent:u,activeTransparent:d};let v=new Cn(0,.04,.1,12);v.translate(0,.05,0);let m=new tn(.08,.08,.08);m.translate(0,.04,0);let _=new en;_.setAttribute("position",new Mt([0,0,0,1,0,0],3));let x=new Cn(.0075,.0075,.5,3);x.translate(0,.25,0);function T(W,$){let H=new Ws(W,.0075,3,64,$*Math.PI*2);return H.rotateY(Math.PI/2),H.rotateX(Math.PI/2),H}function S(){let W=new en;return W.setAttribute("position",new Mt([0,0,0,1,1,1],3)),W}let R={X:[[new Ne(v,r),[.5,0,0],[0,0,-Math.PI/2]],[new Ne(v,r),[-.5,0,0],[0,0,Math.PI/2]],[new Ne(x,r),[0,0,0],[0,0,-Math.PI/2]]],Y:[[new Ne(v,o),[0,.5,0]],[new Ne(v,o),[0,-.5,0],[Math.PI,0,0]],[new Ne(x,o)]],Z:[[new Ne(v,a),[0,0,.5],[Math.PI/2,0,0]],[new Ne(v,a),[0,0,-.5],[-Math.PI/2,0,0]],[new Ne(x,a),null,[Math.PI/2,0,0]]],XYZ:[[new Ne(new hr(.1,0),f),[0,0,0]]],XY:[[new Ne(new tn(.15,.15,.01),u),[.15,.15,0]]],YZ:[[new Ne(new tn(.15,.15,.01),l),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new Ne(new tn(.15,.15,.01),c),[.15,0,.15],[-Math.PI/2,0,0]]]},C={X:[[new Ne(new Cn(.2,0,.6,4),i),[.3,0,0],[0,0,-Math.PI/2]],[new Ne(new Cn(.2,0,.6,4),i),[-.3,0,0],[0,0,Math.PI/2]]],Y:[[new Ne(new Cn(.2,0,.6,4),i),[0,.3,0]],[new Ne(new Cn(.2,0,.6,4),i),[0,-.3,0],[0,0,Math.PI]]],Z:[[new Ne(new Cn(.2,0,.6,4),i),[0,0,.3],[Math.PI/2,0,0]],[new Ne(new Cn(.2,0,.6,4),i),[0,0,-.3],[-Math.PI/2,0,0]]],XYZ:[[new Ne(new hr(.2,0),i)]],XY:[[new Ne(new tn(.2,.2,.01),i),[.15,.15,0]]],YZ:[[new Ne(new tn(.2,.2,.01),i),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new Ne(new tn(.2,.2,.01),i),[.15,0,.15],[-Math.PI/2,0,0]]]},y={START:[[new Ne(new hr(.01,2),s),null,null,null,"helper"]],END:[[new Ne(new hr(.01,2),s),null,null,null,"helper"]],DELTA:[[new vi(S(),s),null,null,null,"helper"]],X:[[new vi(_,s),[-1e3,0,0],null,[1e6,1,1],"helper"]],Y:[[new vi(_,s),[0,-1e3,0],[0,0,Math.PI/2],[1e6,1,1],"helper"]],Z:[[new vi(_,s),[0,0,-1e3],[0,-Math.PI/2,0],[1e6,1,1],"helper"]]},M={XYZE:[[new Ne(T(.5,1),g),null,[0,Math.PI/2,0]]],X:[[new Ne(T(.5,.5),r)]],Y:[[new Ne(T(.5,.5),o),null,[0,0,-Math.PI/2]]],Z:[[new Ne(T(.5,.5),a),null,[0,Math.PI/2,0]]],E:[[new Ne(T(.75,1),d),null,[0,Math.PI/2,0]]]},N={AXIS:[[new vi(_,s),[-1e3,0,0],null,[1e6,1,1],"helper"]]},P={XYZE:[[new Ne(new dr(.25,10,8),i)]],X:[[new Ne(new Ws(.5,.1,4,24),i),[0,0,0],[0,-Math.PI/2,-Math.PI/2]]],Y:[[new Ne(new Ws(.5,.1,4,24),i),[0,0,0],[Math.PI/2,0,0]]],Z:[[new Ne(new Ws(.5,.1,4,24),i),[0,0,0],[0,0,-Math.PI/2]]],E:[[new Ne(new Ws(.75,.1,2,24),i)]]},D={X:[[new Ne(m,r),[.5,0,0],[0,0,-Math.PI/2]],[new Ne(x,r),[0,0,0],[0,0,-Math.PI/2]],[new Ne(m,r),[-.5,0,0],[0,0,Math.PI/2]]],Y:[[new Ne(m,o),[0,.5,0]],[new Ne(x,o)],[new Ne(m,o),[0,-.5,0],[0,0,Math.PI]]],Z:[[new Ne(m,a),[0,0,.5],[Math.PI/2,0,0]],[new Ne(x,a),[0,0,0],[Math.PI/2,0,0]],[new Ne(m,a),[0,0,-.5],[-Math.PI/2,0,0]]],XY:[[new Ne(new tn(.15,.15,.01),u),[.15,.15,0]]],YZ:[[new Ne(new tn(.15,.15,.01),l),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new Ne(new tn(.15,.15,.01),c),[.15,0,.15],[-Math.PI/2,0,0]]],XYZ:[[new Ne(new tn(.1,.1,.1),f)]]},z={X:[[new Ne(new Cn(.2,0,.6,4),i),[.3,0,0],[0,0,-Math.PI/2]],[new Ne(new Cn(.2,0,.6,4),i),[-.3,0,0],[0,0,Math.PI/2]]],Y:[[new Ne(new Cn(.2,0,.6,4),i),[0,.3,0]],[new Ne(new Cn(.2,0,.6,4),i),[0,-.3,0],[0,0,Math.PI]]],Z:[[new Ne(new Cn(.2,0,.6,4),i),[0,0,.3],[Math.PI/2,0,0]],[new Ne(new Cn(.2,0,.6,4),i),[0,0,-.3],[-Math.PI/2,0,0]]],XY:[[new Ne(new tn(.2,.2,.01),i),[.15,.15,0]]],YZ:[[new Ne(new tn(.2,.2,.01),i),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new Ne(new tn(.2,.2,.01),i),[.15,0,.15],[-Math.PI/2,0,0]]],XYZ:[[new Ne(new tn(.2,.2,.2),i),[0,0,0]]]},G={X:[[new vi(_,s),[-1e3,0,0],null,[1e6,1,1],"helper"]],Y:[[new vi(_,s),[0,-1e3,0],[0,0,Math.PI/2],[1e6,1,1],"helper"]],Z:[[new vi(_,s),[0,0,-1e3],[0,-Math.PI/2,0],[1e6,1,1],"helper"]]};function U(W){let $=new ln;for(let H in W)for(let le=W[H].length;le--;){let Y=W[H][le][0].clone(),Q=W[H][le][1],ie=W[H][le][2],he=W[H][le][3],de=W[H][le][4];Y.name=H,Y.tag=de,Q&&Y.position.set(Q[0],Q[1],Q[2]),ie&&Y.rotation.set(ie[0],ie[1],ie[2]),he&&Y.scale.set(he[0],he[1],he[2]),Y.updateMatrix();let ee=Y.geometry.clone();ee.applyMatrix4(Y.matrix),Y.geometry=ee,Y.renderOrder=1/0,Y.position.set(0,0,0),Y.rotation.set(0,0,0),Y.scale.set(1,1,1),$.add(Y)}return $}this.gizmo={},this.picker={},this.helper={},this.add(this.gizmo.translate=U(R)),this.add(this.gizmo.rotate=U(M)),this.add(this.gizmo.scale=U(D)),this.add(this.picker.translate=U(C)),this.add(this.picker.rotate=U(P)),this.add(this.picker.scale=U(z)),this.add(this.helper.translate=U(y)),this.add(this.helper.rotate=U(N)),this.add(this.helper.scale=U(G)),this.picker.translate.visible=!1,this.picker.rotate.visible=!1,this.picker.scale.visible=!1}updateMatrixWorld(e){let i=(this.mode==="scale"?"local":this.space)==="local"?this.worldQuaternion:yh;this.gizmo.translate.visible=this.mode==="translate",this.gizmo.rotate.visible=this.mode==="rotate",this.gizmo.scale.visible=this.mode==="scale",this.helper.translate.visible=this.mode==="translate",this.helper.rotate.visible=this.mode==="rotate",this.helper.scale.visible=this.mode==="scale";let s=[];s=s.concat(this.picker[this.mode].children),s=s.concat(this.gizmo[this.mode].children),s=s.concat(this.helper[this.mode].children);for(let r=0;r<s.length;r++){let o=s[r];o.visible=!0,o.rotation.set(0,0,0),o.position.copy(this.worldPosition);let a;if(this.camera.isOrthographicCamera?a=(this.camera.top-this.camera.bottom)/this.camera.zoom:a=this.worldPosition.distanceTo(this.cameraPosition)*Math.min(1.9*Math.tan(Math.PI*this.camera.fov/360)/this.camera.zoom,7),o.scale.set(1,1,1).multiplyScalar(a*this.size/4),o.tag==="helper"){o.visible=!1,o.name==="AXIS"?(o.visible=!!this.axis,this.axis==="X"&&(on.setFromEuler(_h.set(0,0,0)),o.quaternion.copy(i).multiply(on),Math.abs(Wt.copy(Ll).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="Y"&&(on.setFromEuler(_h.set(0,0,Math.PI/2)),o.quaternion.copy(i).multiply(on),Math.abs(Wt.copy(Yr).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="Z"&&(on.setFromEuler(_h.set(0,Math.PI/2,0)),o.quaternion.copy(i).multiply(on),Math.abs(Wt.copy(Dl).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="XYZE"&&(on.setFromEuler(_h.set(0,Math.PI/2,0)),Wt.copy(this.rotationAxis),o.quaternion.setFromRotationMatrix(L0.lookAt(I0,Wt,Yr)),o.quaternion.multiply(on),o.visible=this.dragging),this.axis==="E"&&(o.visible=!1)):o.name==="START"?(o.position.copy(this.worldPositionStart),o.visible=this.dragging):o.name==="END"?(o.position.copy(this.worldPosition),o.visible=this.dragging):o.name==="DELTA"?(o.position.copy(this.worldPositionStart),o.quaternion.copy(this.worldQuaternionStart),mn.set(1e-10,1e-10,1e-10).add(this.worldPositionStart).sub(this.worldPosition).multiplyScalar(-1),mn.applyQuaternion(this.worldQuaternionStart.clone().invert()),o.scale.copy(mn),o.visible=this.dragging):(o.quaternion.copy(i),this.dragging?o.position.copy(this.worldPositionStart):o.position.copy(this.worldPosition),this.axis&&(o.visible=this.axis.search(o.name)!==-1));continue}o.quaternion.copy(i),this.mode==="translate"||this.mode==="scale"?(o.name==="X"&&Math.abs(Wt.copy(Ll).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="Y"&&Math.abs(Wt.copy(Yr).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="Z"&&Math.abs(Wt.copy(Dl).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="XY"&&Math.abs(Wt.copy(Dl).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="YZ"&&Math.abs(Wt.copy(Ll).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="XZ"&&Math.abs(Wt.copy(Yr).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1)):this.mode==="rotate"&&(vh.copy(i),Wt.copy(this.eye).applyQuaternion(on.copy(i).invert()),o.name.search("E")!==-1&&o.quaternion.setFromRotationMatrix(L0.lookAt(this.eye,I0,Yr)),o.name==="X"&&(on.setFromAxisAngle(Ll,Math.atan2(-Wt.y,Wt.z)),on.multiplyQuaternions(vh,on),o.quaternion.copy(on)),o.name==="Y"&&(on.setFromAxisAngle(Yr,Math.atan2(Wt.x,Wt.z)),on.multiplyQuaternions(vh,on),o.quaternion.copy(on)),o.name==="Z"&&(on.setFromAxisAngle(Dl,Math.atan2(Wt.y,Wt.x)),on.multiplyQuaternions(vh,on),o.quaternion.copy(on))),o.visible=o.visible&&(o.name.indexOf("X")===-1||this.showX),o.visible=o.visible&&(o.name.indexOf("Y")===-1||this.showY),o.visible=o.visible&&(o.name.indexOf("Z")===-1||this.showZ),o.visible=o.visible&&(o.name.indexOf("E")===-1||this.showX&&this.showY&&this.showZ),o.visible=o.visible&&(o.name.indexOf("XY")===-1||this.showXY),o.visible=o.visible&&(o.name.indexOf("YZ")===-1||this.showYZ),o.visible=o.visible&&(o.name.indexOf("XZ")===-1||this.showXZ),o.visible=o.visible&&(o.name!=="E"||this.showE),o.visible=o.visible&&(o.name!=="XYZE"||this.showXYZE),o.material._color=o.material._color||o.material.color.clone(),o.material._opacity=o.material._opacity||o.material.opacity,o.material.color.copy(o.material._color),o.material.opacity=o.material._opacity,this.enabled&&this.axis&&(o.name===this.axis?(o.material.color.copy(this.materialLib.active.color),o.material.opacity=1):this.axis.split("").some(function(l){return o.name===l})&&(o.material.color.copy(this.materialLib.active.color),o.material.opacity=1))}super.updateMatrixWorld(e)}},vp=class extends Ne{constructor(){super(new kr(1e5,1e5,2,2),new is({visible:!1,wireframe:!0,side:xi,transparent:!0,opacity:.1,toneMapped:!1})),this.isTransformControlsPlane=!0,this.type="TransformControlsPlane"}updateMatrixWorld(e){let t=this.space;switch(this.position.copy(this.worldPosition),this.mode==="scale"&&(t="local"),xh.copy(Ll).applyQuaternion(t==="local"?this.worldQuaternion:yh),Pl.copy(Yr).applyQuaternion(t==="local"?this.worldQuaternion:yh),Il.copy(Dl).applyQuaternion(t==="local"?this.worldQuaternion:yh),Wt.copy(Pl),this.mode){case"translate":case"scale":switch(this.axis){case"X":Wt.copy(this.eye).cross(xh),ws.copy(xh).cross(Wt);break;case"Y":Wt.copy(this.eye).cross(Pl),ws.copy(Pl).cross(Wt);break;case"Z":Wt.copy(this.eye).cross(Il),ws.copy(Il).cross(Wt);break;case"XY":ws.copy(Il);break;case"YZ":ws.copy(xh);break;case"XZ":Wt.copy(Il),ws.copy(Pl);break;case"XYZ":case"E":ws.set(0,0,0);break}break;default:ws.set(0,0,0)}ws.length()===0?this.quaternion.copy(this.cameraQuaternion):(Sh.lookAt(mn.set(0,0,0),ws,Wt),this.quaternion.setFromRotationMatrix(Sh)),super.updateMatrixWorld(e)}};var D0=new pn,Mh=new O,na=class extends fl{constructor(){super(),this.isLineSegmentsGeometry=!0,this.type="LineSegmentsGeometry";let e=[-1,2,0,1,2,0,-1,1,0,1,1,0,-1,0,0,1,0,0,-1,-1,0,1,-1,0],t=[-1,2,1,2,-1,1,1,1,-1,-1,1,-1,-1,-2,1,-2],i=[0,2,1,2,3,1,2,4,3,4,5,3,4,6,5,6,7,5];this.setIndex(i),this.setAttribute("position",new Mt(e,3)),this.setAttribute("uv",new Mt(t,2))}applyMatrix4(e){let t=this.attributes.instanceStart,i=this.attributes.instanceEnd;return t!==void 0&&(t.applyMatrix4(e),i.applyMatrix4(e),t.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this}setPositions(e){let t;e instanceof Float32Array?t=e:Array.isArray(e)&&(t=new Float32Array(e));let i=new gr(t,6,1);return this.setAttribute("instanceStart",new Ii(i,3,0)),this.setAttribute("instanceEnd",new Ii(i,3,3)),this.instanceCount=this.attributes.instanceStart.count,this.computeBoundingBox(),this.computeBoundingSphere(),this}setColors(e){let t;e instanceof Float32Array?t=e:Array.isArray(e)&&(t=new Float32Array(e));let i=new gr(t,6,1);return this.setAttribute("instanceColorStart",new Ii(i,3,0)),this.setAttribute("instanceColorEnd",new Ii(i,3,3)),this}fromWireframeGeometry(e){return this.setPositions(e.attributes.position.array),this}fromEdgesGeometry(e){return this.setPositions(e.attributes.position.array),this}fromMesh(e){return this.fromWireframeGeometry(new Br(e.geometry)),this}fromLineSegments(e){let t=e.geometry;return this.setPositions(t.attributes.position.array),this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new pn);let e=this.attributes.instanceStart,t=this.attributes.instanceEnd;e!==void 0&&t!==void 0&&(this.boundingBox.setFromBufferAttribute(e),D0.setFromBufferAttribute(t),this.boundingBox.union(D0))}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Vi),this.boundingBox===null&&this.computeBoundingBox();let e=this.attributes.instanceStart,t=this.attributes.instanceEnd;if(e!==void 0&&t!==void 0){let i=this.boundingSphere.center;this.boundingBox.getCenter(i);let s=0;for(let r=0,o=e.count;r<o;r++)Mh.fromBufferAttribute(e,r),s=Math.max(s,i.distanceToSquared(Mh)),Mh.fromBufferAttribute(t,r),s=Math.max(s,i.distanceToSquared(Mh));this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&console.error("THREE.LineSegmentsGeometry.computeBoundingSphere(): Computed radius is NaN. The instanced position data is likely to have NaN values.",this)}}toJSON(){}};Le.line={worldUnits:{value:1},linewidth:{value:1},resolution:{value:new Xe},dashOffset:{value:0},dashScale:{value:1},dashSize:{value:1},gapSize:{value:1}};mi.line={uniforms:Tl.merge([Le.common,Le.fog,Le.line]),vertexShader:`
		#include <common>
		#include <color_pars_vertex>
		#include <fog_pars_vertex>
		#include <logdepthbuf_pars_vertex>
		#include <clipping_planes_pars_vertex>

		uniform float linewidth;
		uniform vec2 resolution;

		attribute vec3 instanceStart;
		attribute vec3 instanceEnd;

		attribute vec3 instanceColorStart;
		attribute vec3 instanceColorEnd;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#ifdef USE_DASH

			uniform float dashScale;
			attribute float instanceDistanceStart;
			attribute float instanceDistanceEnd;
			varying float vLineDistance;

		#endif

		float trimSegmentAlpha( const in vec4 start, const in vec4 end ) {

			// compute the interpolation factor needed to trim the segment so it terminates
			// between the camera plane and the near plane

			// conservative estimate of the near plane
			float a = projectionMatrix[ 2 ][ 2 ]; // 3nd entry in 3th column
			float b = projectionMatrix[ 3 ][ 2 ]; // 3nd entry in 4th column

			// we need different nearEstimate formula for reversed and default depth buffer
			// a is positive with a reversed depth buffer so it can be used for controlling the code flow
			float nearEstimate = ( a > 0.0 ) ? ( - b / ( a + 1.0 ) ) : ( - 0.5 * b / a );

			return ( nearEstimate - start.z ) / ( end.z - start.z );

		}

		void main() {

			#ifdef USE_COLOR

				vColor.xyz = ( position.y < 0.5 ) ? instanceColorStart : instanceColorEnd;

			#endif

			float aspect = resolution.x / resolution.y;

			// camera space
			vec4 start = modelViewMatrix * vec4( instanceStart, 1.0 );
			vec4 end = modelViewMatrix * vec4( instanceEnd, 1.0 );

			#ifdef USE_DASH

				float lineDistanceStart = dashScale * instanceDistanceStart;
				float lineDistanceEnd = dashScale * instanceDistanceEnd;

			#endif

			#ifdef WORLD_UNITS

				worldStart = start.xyz;
				worldEnd = end.xyz;

			#else

				vUv = uv;

			#endif

			// special case for perspective projection, and segments that terminate either in, or behind, the camera plane
			// clearly the gpu firmware has a way of addressing this issue when projecting into ndc space
			// but we need to perform ndc-space calculations in the shader, so we must address this issue directly
			// perhaps there is a more elegant solution -- WestLangley

			bool perspective = ( projectionMatrix[ 2 ][ 3 ] == - 1.0 ); // 4th entry in the 3rd column

			if ( perspective ) {

				if ( start.z < 0.0 && end.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( start, end );
					end.xyz = mix( start.xyz, end.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceEnd = mix( lineDistanceStart, lineDistanceEnd, alpha );

					#endif

				} else if ( end.z < 0.0 && start.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( end, start );
					start.xyz = mix( end.xyz, start.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceStart = mix( lineDistanceEnd, lineDistanceStart, alpha );

					#endif

				}

			}

			#ifdef USE_DASH

				vLineDistance = ( position.y < 0.5 ) ? lineDistanceStart : lineDistanceEnd;
				vUv = uv;

			#endif

			// clip space
			vec4 clipStart = projectionMatrix * start;
			vec4 clipEnd = projectionMatrix * end;

			// ndc space
			vec3 ndcStart = clipStart.xyz / clipStart.w;
			vec3 ndcEnd = clipEnd.xyz / clipEnd.w;

			// direction
			vec2 dir = ndcEnd.xy - ndcStart.xy;

			// account for clip-space aspect ratio
			dir.x *= aspect;
			dir = normalize( dir );

			#ifdef WORLD_UNITS

				vec3 worldDir = normalize( end.xyz - start.xyz );
				vec3 tmpFwd = perspective ? normalize( mix( start.xyz, end.xyz, 0.5 ) ) : vec3( 0.0, 0.0, - 1.0 );
				vec3 worldUp = normalize( cross( worldDir, tmpFwd ) );
				vec3 worldFwd = cross( worldDir, worldUp );
				worldPos = position.y < 0.5 ? start: end;

				// height offset
				float hw = linewidth * 0.5;
				worldPos.xyz += position.x < 0.0 ? hw * worldUp : - hw * worldUp;

				// don't extend the line if we're rendering dashes because we
				// won't be rendering the endcaps
				#ifndef USE_DASH

					// cap extension
					worldPos.xyz += position.y < 0.5 ? - hw * worldDir : hw * worldDir;

					// add width to the box
					worldPos.xyz += worldFwd * hw;

					// endcaps
					if ( position.y > 1.0 || position.y < 0.0 ) {

						worldPos.xyz -= worldFwd * 2.0 * hw;

					}

				#endif

				// project the worldpos
				vec4 clip = projectionMatrix * worldPos;

				// shift the depth of the projected points so the line
				// segments overlap neatly
				vec3 clipPose = ( position.y < 0.5 ) ? ndcStart : ndcEnd;

				// only shift the depth of vertices in front of the camera (#35137)
				if ( clip.w > 0.0 ) clip.z = clipPose.z * clip.w;

			#else

				vec2 offset = vec2( dir.y, - dir.x );
				// undo aspect ratio adjustment
				dir.x /= aspect;
				offset.x /= aspect;

				// sign flip
				if ( position.x < 0.0 ) offset *= - 1.0;

				// endcaps
				if ( position.y < 0.0 ) {

					offset += - dir;

				} else if ( position.y > 1.0 ) {

					offset += dir;

				}

				// adjust for linewidth
				offset *= linewidth;

				// adjust for clip-space to screen-space conversion // maybe resolution should be based on viewport ...
				offset /= resolution.y;

				// select end
				vec4 clip = ( position.y < 0.5 ) ? clipStart : clipEnd;

				// back to clip space
				offset *= clip.w;

				clip.xy += offset;

			#endif

			gl_Position = clip;

			vec4 mvPosition = ( position.y < 0.5 ) ? start : end; // this is an approximation

			#include <logdepthbuf_vertex>
			#include <clipping_planes_vertex>
			#include <fog_vertex>

		}
		`,fragmentShader:`
		uniform vec3 diffuse;
		uniform float opacity;
		uniform float linewidth;

		#ifdef USE_DASH

			uniform float dashOffset;
			uniform float dashSize;
			uniform float gapSize;

		#endif

		varying float vLineDistance;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#include <common>
		#include <color_pars_fragment>
		#include <fog_pars_fragment>
		#include <logdepthbuf_pars_fragment>
		#include <clipping_planes_pars_fragment>

		vec2 closestLineToLine(vec3 p1, vec3 p2, vec3 p3, vec3 p4) {

			float mua;
			float mub;

			vec3 p13 = p1 - p3;
			vec3 p43 = p4 - p3;

			vec3 p21 = p2 - p1;

			float d1343 = dot( p13, p43 );
			float d4321 = dot( p43, p21 );
			float d1321 = dot( p13, p21 );
			float d4343 = dot( p43, p43 );
			float d2121 = dot( p21, p21 );

			float denom = d2121 * d4343 - d4321 * d4321;

			float numer = d1343 * d4321 - d1321 * d4343;

			mua = numer / denom;
			mua = clamp( mua, 0.0, 1.0 );
			mub = ( d1343 + d4321 * ( mua ) ) / d4343;
			mub = clamp( mub, 0.0, 1.0 );

			return vec2( mua, mub );

		}

		void main() {

			float alpha = opacity;
			vec4 diffuseColor = vec4( diffuse, alpha );

			#include <clipping_planes_fragment>

			#ifdef USE_DASH

				if ( vUv.y < - 1.0 || vUv.y > 1.0 ) discard; // discard endcaps

				if ( mod( vLineDistance + dashOffset, dashSize + gapSize ) > dashSize ) discard; // todo - FIX

			#endif

			#ifdef WORLD_UNITS

				float len;

				if ( isOrthographic ) {

					// View rays are parallel to the z axis so the distance reduces to camera-space XY
					vec2 lineDir = worldEnd.xy - worldStart.xy;
					float t = clamp( dot( worldPos.xy - worldStart.xy, lineDir ) / dot( lineDir, lineDir ), 0.0, 1.0 );
					len = length( worldStart.xy + lineDir * t - worldPos.xy );

				} else {

					// Find the closest points on the view ray and the line segment
					vec3 rayEnd = normalize( worldPos.xyz ) * 1e5;
					vec3 lineDir = worldEnd - worldStart;
					vec2 params = closestLineToLine( worldStart, worldEnd, vec3( 0.0, 0.0, 0.0 ), rayEnd );

					vec3 p1 = worldStart + lineDir * params.x;
					vec3 p2 = rayEnd * params.y;
					vec3 delta = p1 - p2;
					len = length( delta );

				}

				float norm = len / linewidth;

				#ifndef USE_DASH

					#ifdef USE_ALPHA_TO_COVERAGE

						float dnorm = fwidth( norm );
						alpha = 1.0 - smoothstep( 0.5 - dnorm, 0.5 + dnorm, norm );

					#else

						if ( norm > 0.5 ) {

							discard;

						}

					#endif

				#endif

			#else

				#ifdef USE_ALPHA_TO_COVERAGE

					// artifacts appear on some hardware if a derivative is taken within a conditional
					float a = vUv.x;
					float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
					float len2 = a * a + b * b;
					float dlen = fwidth( len2 );

					if ( abs( vUv.y ) > 1.0 ) {

						alpha = 1.0 - smoothstep( 1.0 - dlen, 1.0 + dlen, len2 );

					}

				#else

					if ( abs( vUv.y ) > 1.0 ) {

						float a = vUv.x;
						float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
						float len2 = a * a + b * b;

						if ( len2 > 1.0 ) discard;

					}

				#endif

			#endif

			#include <logdepthbuf_fragment>
			#include <color_fragment>

			gl_FragColor = vec4( diffuseColor.rgb, alpha );

			#include <tonemapping_fragment>
			#include <colorspace_fragment>
			#include <fog_fragment>
			#include <premultiplied_alpha_fragment>

		}
		`};var Mr=class extends Gi{constructor(e){super({type:"LineMaterial",uniforms:Tl.clone(mi.line.uniforms),vertexShader:mi.line.vertexShader,fragmentShader:mi.line.fragmentShader,clipping:!0}),this.isLineMaterial=!0,this.setValues(e)}get color(){return this.uniforms.diffuse.value}set color(e){this.uniforms.diffuse.value=e}get worldUnits(){return"WORLD_UNITS"in this.defines}set worldUnits(e){e===!0!==this.worldUnits&&(this.needsUpdate=!0),e===!0?this.defines.WORLD_UNITS="":delete this.defines.WORLD_UNITS}get linewidth(){return this.uniforms.linewidth.value}set linewidth(e){this.uniforms.linewidth&&(this.uniforms.linewidth.value=e)}get dashed(){return"USE_DASH"in this.defines}set dashed(e){e===!0!==this.dashed&&(this.needsUpdate=!0),e===!0?this.defines.USE_DASH="":delete this.defines.USE_DASH}get dashScale(){return this.uniforms.dashScale.value}set dashScale(e){this.uniforms.dashScale.value=e}get dashSize(){return this.uniforms.dashSize.value}set dashSize(e){this.uniforms.dashSize.value=e}get dashOffset(){return this.uniforms.dashOffset.value}set dashOffset(e){this.uniforms.dashOffset.value=e}get gapSize(){return this.uniforms.gapSize.value}set gapSize(e){this.uniforms.gapSize.value=e}get opacity(){return this.uniforms.opacity.value}set opacity(e){this.uniforms&&(this.uniforms.opacity.value=e)}get resolution(){return this.uniforms.resolution.value}set resolution(e){this.uniforms.resolution.value.copy(e)}get alphaToCoverage(){return"USE_ALPHA_TO_COVERAGE"in this.defines}set alphaToCoverage(e){this.defines&&(e===!0!==this.alphaToCoverage&&(this.needsUpdate=!0),e===!0?this.defines.USE_ALPHA_TO_COVERAGE="":delete this.defines.USE_ALPHA_TO_COVERAGE)}};var xp=new Nt,N0=new O,U0=new O,Jn=new Nt,Kn=new Nt,Ts=new Nt,yp=new O,bp=new Et,jn=new ml,O0=new O,wh=new pn,Th=new Vi,Es=new Nt,As,$r;function F0(n,e,t){return Es.set(0,0,-e,1).applyMatrix4(n.projectionMatrix),Es.multiplyScalar(1/Es.w),Es.x=$r/t.width,Es.y=$r/t.height,Es.applyMatrix4(n.projectionMatrixInverse),Es.multiplyScalar(1/Es.w),Math.abs(Math.max(Es.x,Es.y))}function QT(n,e){let t=n.matrixWorld,i=n.geometry,s=i.attributes.instanceStart,r=i.attributes.instanceEnd,o=Math.min(i.instanceCount,s.count);for(let a=0,l=o;a<l;a++){jn.start.fromBufferAttribute(s,a),jn.end.fromBufferAttribute(r,a),jn.applyMatrix4(t);let c=new O,u=new O;As.distanceSqToSegment(jn.start,jn.end,u,c),u.distanceTo(c)<$r*.5&&e.push({point:u,pointOnLine:c,distance:As.origin.distanceTo(u),object:n,face:null,faceIndex:a,uv:null,uv1:null})}}function eE(n,e,t){let i=e.projectionMatrix,r=n.material.resolution,o=n.matrixWorld,a=n.geometry,l=a.attributes.instanceStart,c=a.attributes.instanceEnd,u=Math.min(a.instanceCount,l.count),f=-e.near;As.at(1,Ts),Ts.w=1,Ts.applyMatrix4(e.matrixWorldInverse),Ts.applyMatrix4(i),Ts.multiplyScalar(1/Ts.w),Ts.x*=r.x/2,Ts.y*=r.y/2,Ts.z=0,yp.copy(Ts),bp.multiplyMatrices(e.matrixWorldInverse,o);for(let d=0,p=u;d<p;d++){if(Jn.fromBufferAttribute(l,d),Kn.fromBufferAttribute(c,d),Jn.w=1,Kn.w=1,Jn.applyMatrix4(bp),Kn.applyMatrix4(bp),Jn.z>f&&Kn.z>f)continue;if(Jn.z>f){let T=Jn.z-Kn.z,S=(Jn.z-f)/T;Jn.lerp(Kn,S)}else if(Kn.z>f){let T=Kn.z-Jn.z,S=(Kn.z-f)/T;Kn.lerp(Jn,S)}Jn.applyMatrix4(i),Kn.applyMatrix4(i),Jn.multiplyScalar(1/Jn.w),Kn.multiplyScalar(1/Kn.w),Jn.x*=r.x/2,Jn.y*=r.y/2,Kn.x*=r.x/2,Kn.y*=r.y/2,jn.start.copy(Jn),jn.start.z=0,jn.end.copy(Kn),jn.end.z=0;let v=jn.closestPointToPointParameter(yp,!0);jn.at(v,O0);let m=wl.lerp(Jn.z,Kn.z,v),_=m>=-1&&m<=1,x=yp.distanceTo(O0)<$r*.5;if(_&&x){jn.start.fromBufferAttribute(l,d),jn.end.fromBufferAttribute(c,d),jn.start.applyMatrix4(o),jn.end.applyMatrix4(o);let T=new O,S=new O;As.distanceSqToSegment(jn.start,jn.end,S,T),t.push({point:S,pointOnLine:T,distance:As.origin.distanceTo(S),object:n,face:null,faceIndex:d,uv:null,uv1:null})}}}var Eh=class extends Ne{constructor(e=new na,t=new Mr({color:Math.random()*16777215})){super(e,t),this.isLineSegments2=!0,this.type="LineSegments2"}computeLineDistances(){let e=this.geometry,t=e.attributes.instanceStart,i=e.attributes.instanceEnd,s=new Float32Array(2*t.count);for(let o=0,a=0,l=t.count;o<l;o++,a+=2)N0.fromBufferAttribute(t,o),U0.fromBufferAttribute(i,o),s[a]=a===0?0:s[a-1],s[a+1]=s[a]+N0.distanceTo(U0);let r=new gr(s,2,1);return e.setAttribute("instanceDistanceStart",new Ii(r,1,0)),e.setAttribute("instanceDistanceEnd",new Ii(r,1,1)),this}raycast(e,t){let i=this.material.worldUnits,s=e.camera;if(s===null&&!i&&console.error('LineSegments2: "Raycaster.camera" needs to be set in order to raycast against LineSegments2 while worldUnits is set to false.'),i===!1&&(this.material.resolution.x===0||this.material.resolution.y===0))return;let r=e.params.Line2!==void 0&&e.params.Line2.threshold||0;As=e.ray;let o=this.matrixWorld,a=this.geometry,l=this.material;$r=l.linewidth+r,a.boundingSphere===null&&a.computeBoundingSphere(),Th.copy(a.boundingSphere).applyMatrix4(o);let c;if(i)c=$r*.5;else{let f=Math.max(s.near,Th.distanceToPoint(As.origin));c=F0(s,f,l.resolution)}if(Th.radius+=c,As.intersectsSphere(Th)===!1)return;a.boundingBox===null&&a.computeBoundingBox(),wh.copy(a.boundingBox).applyMatrix4(o);let u;if(i)u=$r*.5;else{let f=Math.max(s.near,wh.distanceToPoint(As.origin));u=F0(s,f,l.resolution)}wh.expandByScalar(u),As.intersectsBox(wh)!==!1&&(i?QT(this,t):eE(this,s,t))}onBeforeRender(e){let t=this.material.uniforms;t&&t.resolution&&(e.getViewport(xp),this.material.uniforms.resolution.value.set(xp.z,xp.w))}};var ia=class extends na{constructor(){super(),this.isLineGeometry=!0,this.type="LineGeometry"}setPositions(e){let t=e.length-3,i=new Float32Array(2*t);for(let s=0;s<t;s+=3)i[2*s]=e[s],i[2*s+1]=e[s+1],i[2*s+2]=e[s+2],i[2*s+3]=e[s+3],i[2*s+4]=e[s+4],i[2*s+5]=e[s+5];return super.setPositions(i),this}setColors(e){let t=e.length-3,i=new Float32Array(2*t);for(let s=0;s<t;s+=3)i[2*s]=e[s],i[2*s+1]=e[s+1],i[2*s+2]=e[s+2],i[2*s+3]=e[s+3],i[2*s+4]=e[s+4],i[2*s+5]=e[s+5];return super.setColors(i),this}setFromPoints(e){let t=e.length-1,i=new Float32Array(6*t);for(let s=0;s<t;s++)i[6*s]=e[s].x,i[6*s+1]=e[s].y,i[6*s+2]=e[s].z||0,i[6*s+3]=e[s+1].x,i[6*s+4]=e[s+1].y,i[6*s+5]=e[s+1].z||0;return super.setPositions(i),this}fromLine(e){let t=e.geometry;return this.setPositions(t.attributes.position.array),this}};var Ah=class extends Eh{constructor(e=new ia,t=new Mr({color:Math.random()*16777215})){super(e,t),this.isLine2=!0,this.type="Line2"}};var tE=new it("#3d8bd4"),k0=new it("#3fae6b"),G0=new it("#d64545"),H0=new it("#8a8f98"),nE=.9,B0=.3,iE=new O(0,1,0),sE=4,rE=25,oE=4,aE=2e-4,lE=2,z0=1e9,cE=.04,Rn=n=>new O(n[0]??0,n[1]??0,n[2]??0);function Mp(n,e,t){if(n===null||e===null||t===null||n<e/4)return H0.clone();let i=Math.min(Math.max((n-e)/(t-e),0),1);return i<.5?tE.clone().lerp(k0,2*i):k0.clone().lerp(G0,2*i-1)}function uE(n){let e=n.body?new pn(Rn(n.body.min_m),Rn(n.body.max_m)):new pn().setFromPoints(n.anchor_points_m.map(Rn)),t=e.getSize(new O);return t.set(...t.toArray().map(i=>Math.max(i,cE))),{centre:e.getCenter(new O),size:t}}function Ch(n,e,t){let i=new Fr(new rl(new tn(n.x,n.y,n.z)),t);return i.position.copy(e),i}function V0(n,e,t){let i=document.createElement("canvas");i.width=i.height=64;let s=i.getContext("2d");s.fillStyle="#1f4f80",s.arc(32,32,30,0,2*Math.PI),s.fill(),s.fillStyle="#ffffff",s.font="600 38px system-ui, sans-serif",s.textAlign="center",s.textBaseline="middle",s.fillText(n,32,34);let r=new nl(i);r.colorSpace=ui;let o=new ja(new Wo({map:r,depthTest:!1}));return o.position.copy(e),o.scale.setScalar(t),o.renderOrder=1,o}var Sp=class{constructor(e){this.host=e;this.#e=new dh({antialias:!0,alpha:!0}),this.#e.setPixelRatio(Math.min(devicePixelRatio,2)),e.append(this.#e.domElement),this.#n=new gh(this.#i,this.#e.domElement),this.#n.addEventListener("change",()=>this.#l()),this.#a=new bh(this.#i,this.#e.domElement),this.#a.addEventListener("change",()=>this.#l()),this.#a.addEventListener("dragging-changed",({value:i})=>this.#n.enabled=!i),this.#a.addEventListener("objectChange",()=>this.#E());let t=new dl("#ffffff",1.6);t.position.set(3,8,5),this.#t.add(new cl("#ffffff","#7788aa",1.6),t,this.#s,this.#a.getHelper()),this.#x=new ResizeObserver(()=>this.#w()),this.#x.observe(e),this.#w()}host;#e;#t=new $a;#i=new hi(40,1,.05,500);#n;#s=new Ri;#r=new Ri;#o=new Ri;#a;#d=null;#c=new Ri;#u=new Ri;#h=null;#b=0;#m=[];#p=[];#f=null;#S=new qo({color:"#ffb454",transparent:!0,opacity:B0,roughness:.6});numbered=!1;#g=!1;#_=!1;#v=[];#x;close(){this.#x.disconnect(),this.#a.dispose(),this.#n.dispose(),this.#e.dispose(),this.#e.domElement.remove()}describe(e){this.#f=e,this.#v=[],this.#s.clear(),this.#r.clear(),this.#o.clear();let t=e.platform;if(!t)return;let i=t.workspace_min_m.length===2;this.#s.rotation.x=i?0:-Math.PI/2;let s=t.exit_points_m.map(Rn),r=new en().setFromPoints(s);this.numbered&&this.#T(s,t.anchor_points_m.map(Rn)),this.#s.add(new el(r,new Xo({color:"#7a8797",size:9,sizeAttenuation:!1}))),this.#A(t),this.#C(t),this.#p=s;let o=new pn().setFromPoints(s).getSize(new O).length()/450;this.#m=s.map(()=>new Ne(new Cn(o,o,1,6),new is({color:H0}))),this.#s.add(this.#r,this.#o,this.#c,this.#u,...this.#m),this.#o.visible=!1,this.#y(this.#r,Rn(t.home_m),new zt),this.#M(null),this.#R(s,i),this.#P(s,t,i)}show(e){if(!this.#f?.platform)return;let i=[...e.pose.map(f=>(f??z0)/aE),...e.tension_N.map(f=>(f??z0)/lE)];if(i.every((f,d)=>Math.abs(f-(this.#v[d]??1/0))<1))return;this.#v=i;let[s,r,o,a,l,c,u]=e.pose;if(this.#S.opacity=s==null?B0:nE,s!=null&&r!=null){let f=a==null?new zt:new zt(l??0,c??0,u??0,a);this.#y(this.#r,new O(s,r,o??0),f)}this.#M(e),this.#l()}aim(e,t){if(this.#o.visible=e!==null,e){let i=t?.length===1?new O(0,0,t[0]):Rn(t??[]),s=i.length(),r=new zt().setFromAxisAngle(s?i.divideScalar(s):new O(0,0,1),s);this.#y(this.#o,Rn(e),r)}this.#l()}#T(e,t){let i=new pn().setFromPoints(e).getSize(new O).length();e.forEach((r,o)=>this.#s.add(V0(String(o+1),r,i/18)));let s=t.map((r,o)=>t.slice(0,o).filter(a=>a.distanceTo(r)<1e-6).length);t.forEach((r,o)=>{let a=V0(String(o+1),r,i/30);a.center.set(.5-.8*s[o],.5),this.#r.add(a)})}workspace(e){if(this.#u.clear(),e){let t=new en().setFromPoints(e.points_m.map(Rn));e.triangles.length&&t.setIndex(e.triangles.flat());let i={color:"#1f8a8a",transparent:!0,depthWrite:!1};this.#u.add(e.triangles.length?new Ne(t,new is({...i,opacity:.12,side:xi})):new Qa(t,new _i(i))),e.triangles.length&&this.#u.add(new Fr(new Br(t),new _i({...i,opacity:.18})))}this.#l()}drag(e,t=null){let i=this.#f?.platform;if(this.#d=t,!e||!i)return this.#a.detach(),this.#l();let s=i.workspace_min_m.length===2,r=e==="turn"&&s;this.#a.setMode(e==="turn"?"rotate":"translate"),Object.assign(this.#a,{showX:!r,showY:!r,showZ:r||!s,size:.9}),this.#a.attach(this.#o),this.#l()}#E(){let e=this.#f?.platform;if(!e||!this.#d)return;let{position:t,quaternion:i}=this.#o;t.clamp(Rn(e.workspace_min_m),Rn(e.workspace_max_m));let s=Math.acos(Math.min(Math.abs(i.w),1)),r=Math.sign(i.w)||1,o=new O(i.x,i.y,i.z).setLength(2*r*s),a=e.controlled.filter(c=>c.length>1),l=a.length===1?[o.z]:o.toArray().slice(0,a.length);this.#d(t.toArray().slice(0,e.workspace_min_m.length),l.map(c=>c||0))}route(e,t){if(this.#c.clear(),this.#h=null,e&&e.length>1){let i=e.flatMap(r=>Rn(r).toArray()),s=(r,o)=>new Ah(new ia().setPositions(i),new Mr({color:r,linewidth:o,depthTest:!1,transparent:!0}));this.#h=s("#1f9d57",4),this.#c.add(s("#9a6fd0",2.5),this.#h)}if(t){let i=Math.max(...this.#p.map(r=>r.length()))/60,s=new Ne(new dr(i,16,12),new is({color:G0,depthTest:!1,transparent:!0}));s.position.copy(Rn(t)),this.#c.add(s)}this.#c.children.forEach((i,s)=>i.renderOrder=2+s),this.done(this.#b)}done(e){if(this.#b=e,this.#h){let t=this.#h.geometry;t.instanceCount=Math.round(e*t.attributes.instanceStart.count),this.#h.visible=t.instanceCount>0}this.#l()}#A(e){let t=new pn(Rn(e.workspace_min_m),Rn(e.workspace_max_m)),i=new ol({color:"#9a6fd0",dashSize:.06,gapSize:.04}),s=Ch(t.getSize(new O),t.getCenter(new O),i);s.computeLineDistances(),this.#s.add(s);for(let r of e.obstacles){let o=new pn(Rn(r.min_m),Rn(r.max_m));this.#s.add(Ch(o.getSize(new O),o.getCenter(new O),new _i({color:"#b02f2f"})))}}#C(e){let{centre:t,size:i}=uE(e),s=new Ne(new tn(i.x,i.y,i.z),this.#S);s.position.copy(t),this.#r.add(s,Ch(i,t,new _i({color:"#8a5a10"})));let r=new dr(Math.max(i.length()/60,.006),12,8);for(let o of e.anchor_points_m){let a=new Ne(r,new qo({color:"#444c57"}));a.position.copy(Rn(o)),this.#r.add(a)}this.#o.add(Ch(i,t,new _i({color:"#9a6fd0"})))}#R(e,t){this.#t.children.filter(c=>c instanceof Zo).forEach(c=>this.#t.remove(c));let i=new pn().setFromPoints(e),s=i.getSize(new O),r=1.2*Math.max(s.x,t?s.x/2:s.y),o=new Zo(r,Math.round(r*2),"#8894a3","#8894a3"),a=i.getCenter(new O),l=t?i.min.y:Math.min(i.min.z,0);o.position.set(a.x,l,t?0:-a.y),o.material.transparent=!0,o.material.opacity=.25,this.#t.add(o)}#P(e,t,i){this.#s.updateMatrixWorld(!0);let s=new pn().setFromPoints([...e,Rn(t.home_m)].map(c=>this.#s.localToWorld(c.clone()))),r=s.getCenter(new O),o=s.getSize(new O).length(),a=i?new O(.1,.08,1):new O(.75,.5,1),l=Math.max(1.2/this.#i.aspect,1);this.#i.position.copy(r).addScaledVector(a.normalize(),l*o*(i?1.15:1.2)),this.#n.target.copy(r),this.#n.update()}#y(e,t,i){e.position.copy(t),e.quaternion.copy(i),e.updateMatrix()}#M(e){let{platform:t,limits:i}=this.#f;this.#m.forEach((s,r)=>{let o=Rn(t.anchor_points_m[r]).applyMatrix4(this.#r.matrix),a=o.clone().sub(this.#p[r]);s.position.copy(o).add(this.#p[r]).divideScalar(2),s.scale.y=a.length(),s.quaternion.setFromUnitVectors(iE,a.normalize());let l=e?.tension_N[r]??null,c=Mp(l,i.tension_min_N[r]??null,i.tension_max_N[r]??null);s.material.color.copy(c)})}#w(){let{clientWidth:e,clientHeight:t}=this.host;!e||!t||(this.#e.setSize(e,t),this.#i.aspect=e/t,this.#i.updateProjectionMatrix(),this.#l())}#l(){if(this.#g){this.#_=!0;return}this.#g=!0,requestAnimationFrame(()=>{let e=performance.now();this.#e.render(this.#t,this.#i);let t=this.#e.getContext(),i=t.fenceSync(t.SYNC_GPU_COMMANDS_COMPLETE,0);t.flush();let s=()=>{let r=performance.now()-e;if(i&&t.getSyncParameter(i,t.SYNC_STATUS)===t.UNSIGNALED)return void setTimeout(s,sE);t.deleteSync(i),setTimeout(()=>{this.#g=!1,this.#_&&this.#l(),this.#_=!1},r>rE?oE*r:0)};setTimeout(s)})}};function Rh(n){try{return new Sp(n)}catch{return n.classList.add("undrawn"),n.textContent="This browser cannot draw in three dimensions (WebGL). Everything else works.",null}}var hE="uplot",dE="u-hz",fE="u-vt",pE="u-title",mE="u-wrap",gE="u-under",_E="u-over",vE="u-axis",Kr="u-off",xE="u-select",yE="u-cursor-x",bE="u-cursor-y",SE="u-cursor-pt",ME="u-legend",wE="u-live",TE="u-inline",EE="u-series",AE="u-marker",W0="u-label",CE="u-value",Ul="width",Ol="height";var X0="bottom",sa="left",wp="right",Vp="#000",q0=Vp+"0",Tp="mousemove",Y0="mousedown",Ep="mouseup",$0="mouseenter",Z0="mouseleave",J0="dblclick",RE="resize",PE="scroll",K0="change",Nh="dppxchange",Gp="--",ha=typeof window<"u",Ip=ha?document:null,oa=ha?window:null,IE=ha?navigator:null,Lt,Ph;function Lp(){let n=devicePixelRatio;Lt!=n&&(Lt=n,Ph&&Np(K0,Ph,Lp),Ph=matchMedia(`(min-resolution: ${Lt-.001}dppx) and (max-resolution: ${Lt+.001}dppx)`),jr(K0,Ph,Lp),oa.dispatchEvent(new CustomEvent(Nh)))}function Di(n,e){if(e!=null){let t=n.classList;!t.contains(e)&&t.add(e)}}function Dp(n,e){let t=n.classList;t.contains(e)&&t.remove(e)}function nn(n,e,t){n.style[e]=t+"px"}function ls(n,e,t,i){let s=Ip.createElement(n);return e!=null&&Di(s,e),t?.insertBefore(s,i),s}function Hi(n,e){return ls("div",n,e)}var j0=new WeakMap;function Cs(n,e,t,i,s){let r="translate("+e+"px,"+t+"px)",o=j0.get(n);r!=o&&(n.style.transform=r,j0.set(n,r),e<0||t<0||e>i||t>s?Di(n,Kr):Dp(n,Kr))}var Q0=new WeakMap;function ev(n,e,t){let i=e+t,s=Q0.get(n);i!=s&&(Q0.set(n,i),n.style.background=e,n.style.borderColor=t)}var tv=new WeakMap;function nv(n,e,t,i){let s=e+""+t,r=tv.get(n);s!=r&&(tv.set(n,s),n.style.height=t+"px",n.style.width=e+"px",n.style.marginLeft=i?-e/2+"px":0,n.style.marginTop=i?-t/2+"px":0)}var Hp={passive:!0},LE={...Hp,capture:!0};function jr(n,e,t,i){e.addEventListener(n,t,i?LE:Hp)}function Np(n,e,t,i){e.removeEventListener(n,t,Hp)}ha&&Lp();function cs(n,e,t,i){let s;t=t||0,i=i||e.length-1;let r=i<=2147483647;for(;i-t>1;)s=r?t+i>>1:Ni((t+i)/2),e[s]<n?t=s:i=s;return n-e[t]<=e[i]-n?t:i}function Pv(n){return(t,i,s)=>{let r=-1,o=-1;for(let a=i;a<=s;a++)if(n(t[a])){r=a;break}for(let a=s;a>=i;a--)if(n(t[a])){o=a;break}return[r,o]}}var Iv=n=>n!=null,Lv=n=>n!=null&&n>0,Fh=Pv(Iv),DE=Pv(Lv);function NE(n,e,t,i=0,s=!1){let r=s?DE:Fh,o=s?Lv:Iv;[e,t]=r(n,e,t);let a=n[e],l=n[e];if(e>-1)if(i==1)a=n[e],l=n[t];else if(i==-1)a=n[t],l=n[e];else for(let c=e;c<=t;c++){let u=n[c];o(u)&&(u<a?a=u:u>l&&(l=u))}return[a??Xt,l??-Xt]}function kh(n,e,t,i){let s=rv(n),r=rv(e);n==e&&(s==-1?(n*=t,e/=t):(n/=t,e*=t));let o=t==10?$s:Dv,a=s==1?Ni:Wi,l=r==1?Wi:Ni,c=a(o(kn(n))),u=l(o(kn(e))),f=aa(t,c),d=aa(t,u);return t==10&&(c<0&&(f=qt(f,-c)),u<0&&(d=qt(d,-u))),i||t==2?(n=f*s,e=d*r):(n=Fv(n,f),e=Bh(e,d)),[n,e]}function Wp(n,e,t,i){let s=kh(n,e,t,i);return n==0&&(s[0]=0),e==0&&(s[1]=0),s}var Xp=.1,iv={mode:3,pad:Xp},kl={pad:0,soft:null,mode:0},UE={min:kl,max:kl};function Uh(n,e,t,i){return zh(t)?sv(n,e,t):(kl.pad=t,kl.soft=i?0:null,kl.mode=i?3:0,sv(n,e,UE))}function Rt(n,e){return n??e}function OE(n,e,t){for(e=Rt(e,0),t=Rt(t,n.length-1);e<=t;){if(n[e]!=null)return!0;e++}return!1}function sv(n,e,t){let i=t.min,s=t.max,r=Rt(i.pad,0),o=Rt(s.pad,0),a=Rt(i.hard,-Xt),l=Rt(s.hard,Xt),c=Rt(i.soft,Xt),u=Rt(s.soft,-Xt),f=Rt(i.mode,0),d=Rt(s.mode,0),p=e-n,g=$s(p),v=gi(kn(n),kn(e)),m=$s(v),_=kn(m-g);(p<1e-24||_>10)&&(p=0,(n==0||e==0)&&(p=1e-24,f==2&&c!=Xt&&(r=0),d==2&&u!=-Xt&&(o=0)));let x=p||v||1e3,T=$s(x),S=aa(10,Ni(T)),R=x*(p==0?n==0?.1:1:r),C=qt(Fv(n-R,S/10),24),y=n>=c&&(f==1||f==3&&C<=c||f==2&&C>=c)?c:Xt,M=gi(a,C<y&&n>=y?y:us(y,C)),N=x*(p==0?e==0?.1:1:o),P=qt(Bh(e+N,S/10),24),D=e<=u&&(d==1||d==3&&P>=u||d==2&&P<=u)?u:-Xt,z=us(l,P>D&&e<=D?D:gi(D,P));return M==z&&M==0&&(z=100),[M,z]}var FE=new Intl.NumberFormat(ha?IE.language:"en-US"),qp=n=>FE.format(n),Ui=Math,Dh=Ui.PI,kn=Ui.abs,Ni=Ui.floor,Fn=Ui.round,Wi=Ui.ceil,us=Ui.min,gi=Ui.max,aa=Ui.pow,rv=Ui.sign,$s=Ui.log10,Dv=Ui.log2,kE=(n,e=1)=>Ui.sinh(n)*e,Ap=(n,e=1)=>Ui.asinh(n/e),Xt=1/0;function ov(n){return($s((n^n>>31)-(n>>31))|0)+1}function Up(n,e,t){return us(gi(n,e),t)}function Nv(n){return typeof n=="function"}function wt(n){return Nv(n)?n:()=>n}var BE=()=>{},Uv=n=>n,Ov=(n,e)=>e,zE=n=>null,av=n=>!0,lv=(n,e)=>n==e,VE=/\.\d*?(?=9{6,}|0{6,})/gm,Qr=n=>{if(Bv(n)||Tr.has(n))return n;let e=`${n}`,t=e.match(VE);if(t==null)return n;let i=t[0].length-1;if(e.indexOf("e-")!=-1){let[s,r]=e.split("e");return+`${Qr(s)}e${r}`}return qt(n,i)};function Zr(n,e){return Qr(qt(Qr(n/e))*e)}function Bh(n,e){return Qr(Wi(Qr(n/e))*e)}function Fv(n,e){return Qr(Ni(Qr(n/e))*e)}function qt(n,e=0){if(Bv(n))return n;let t=10**e,i=n*t*(1+Number.EPSILON);return Fn(i)/t}var Tr=new Map;function kv(n){return((""+n).split(".")[1]||"").length}function zl(n,e,t,i){let s=[],r=i.map(kv);for(let o=e;o<t;o++){let a=kn(o),l=qt(aa(n,o),a);for(let c=0;c<i.length;c++){let u=n==10?+`${i[c]}e${o}`:i[c]*l,f=(o>=0?0:a)+(o>=r[c]?0:r[c]),d=n==10?u:qt(u,f);s.push(d),Tr.set(d,f)}}return s}var Bl={},Yp=[],la=[null,null],wr=Array.isArray,Bv=Number.isInteger,GE=n=>n===void 0;function cv(n){return typeof n=="string"}function zh(n){let e=!1;if(n!=null){let t=n.constructor;e=t==null||t==Object}return e}function HE(n){return n!=null&&typeof n=="object"}var WE=Object.getPrototypeOf(Uint8Array),zv="__proto__";function ca(n,e=zh){let t;if(wr(n)){let i=n.find(s=>s!=null);if(wr(i)||e(i)){t=Array(n.length);for(let s=0;s<n.length;s++)t[s]=ca(n[s],e)}else t=n.slice()}else if(n instanceof WE)t=n.slice();else if(e(n)){t={};for(let i in n)i!=zv&&(t[i]=ca(n[i],e))}else t=n;return t}function Pn(n){let e=arguments;for(let t=1;t<e.length;t++){let i=e[t];for(let s in i)s!=zv&&(zh(n[s])?Pn(n[s],ca(i[s])):n[s]=ca(i[s]))}return n}var XE=0,qE=1,YE=2;function $E(n,e,t){for(let i=0,s,r=-1;i<e.length;i++){let o=e[i];if(o>r){for(s=o-1;s>=0&&n[s]==null;)n[s--]=null;for(s=o+1;s<t&&n[s]==null;)n[r=s++]=null}}}function ZE(n,e){if(jE(n)){let o=n[0].slice();for(let a=1;a<n.length;a++)o.push(...n[a].slice(1));return QE(o[0])||(o=KE(o)),o}let t=new Set;for(let o=0;o<n.length;o++){let l=n[o][0],c=l.length;for(let u=0;u<c;u++)t.add(l[u])}let i=[Array.from(t).sort((o,a)=>o-a)],s=i[0].length,r=new Map;for(let o=0;o<s;o++)r.set(i[0][o],o);for(let o=0;o<n.length;o++){let a=n[o],l=a[0];for(let c=1;c<a.length;c++){let u=a[c],f=Array(s).fill(void 0),d=e?e[o][c]:qE,p=[];for(let g=0;g<u.length;g++){let v=u[g],m=r.get(l[g]);v===null?d!=XE&&(f[m]=v,d==YE&&p.push(m)):f[m]=v}$E(f,p,s),i.push(f)}}return i}var JE=typeof queueMicrotask>"u"?n=>Promise.resolve().then(n):queueMicrotask;function KE(n){let e=n[0],t=e.length,i=Array(t);for(let r=0;r<i.length;r++)i[r]=r;i.sort((r,o)=>e[r]-e[o]);let s=[];for(let r=0;r<n.length;r++){let o=n[r],a=Array(t);for(let l=0;l<t;l++)a[l]=o[i[l]];s.push(a)}return s}function jE(n){let e=n[0][0],t=e.length;for(let i=1;i<n.length;i++){let s=n[i][0];if(s.length!=t)return!1;if(s!=e){for(let r=0;r<t;r++)if(s[r]!=e[r])return!1}}return!0}function QE(n,e=100){let t=n.length;if(t<=1)return!0;let i=0,s=t-1;for(;i<=s&&n[i]==null;)i++;for(;s>=i&&n[s]==null;)s--;if(s<=i)return!0;let r=gi(1,Ni((s-i+1)/e));for(let o=n[i],a=i+r;a<=s;a+=r){let l=n[a];if(l!=null){if(l<=o)return!1;o=l}}return!0}var Vv=["January","February","March","April","May","June","July","August","September","October","November","December"],Gv=["Sunday","Monday","Tuesday","Wednesday","Thursday","Friday","Saturday"];function Hv(n){return n.slice(0,3)}var eA=Gv.map(Hv),tA=Vv.map(Hv),nA={MMMM:Vv,MMM:tA,WWWW:Gv,WWW:eA};function Nl(n){return(n<10?"0":"")+n}function iA(n){return(n<10?"00":n<100?"0":"")+n}var sA={YYYY:n=>n.getFullYear(),YY:n=>(n.getFullYear()+"").slice(2),MMMM:(n,e)=>e.MMMM[n.getMonth()],MMM:(n,e)=>e.MMM[n.getMonth()],MM:n=>Nl(n.getMonth()+1),M:n=>n.getMonth()+1,DD:n=>Nl(n.getDate()),D:n=>n.getDate(),WWWW:(n,e)=>e.WWWW[n.getDay()],WWW:(n,e)=>e.WWW[n.getDay()],HH:n=>Nl(n.getHours()),H:n=>n.getHours(),h:n=>{let e=n.getHours();return e==0?12:e>12?e-12:e},AA:n=>n.getHours()>=12?"PM":"AM",aa:n=>n.getHours()>=12?"pm":"am",a:n=>n.getHours()>=12?"p":"a",mm:n=>Nl(n.getMinutes()),m:n=>n.getMinutes(),ss:n=>Nl(n.getSeconds()),s:n=>n.getSeconds(),fff:n=>iA(n.getMilliseconds())};function $p(n,e){e=e||nA;let t=[],i=/\{([a-z]+)\}|[^{]+/gi,s;for(;s=i.exec(n);)t.push(s[0][0]=="{"?sA[s[1]]:s[0]);return r=>{let o="";for(let a=0;a<t.length;a++)o+=typeof t[a]=="string"?t[a]:t[a](r,e);return o}}var rA=new Intl.DateTimeFormat().resolvedOptions().timeZone;function oA(n,e){let t;return e=="UTC"||e=="Etc/UTC"?t=new Date(+n+n.getTimezoneOffset()*6e4):e==rA?t=n:(t=new Date(n.toLocaleString("en-US",{timeZone:e})),t.setMilliseconds(n.getMilliseconds())),t}var Wv=n=>n%1==0,Oh=[1,2,2.5,5],aA=zl(10,-32,0,Oh),Xv=zl(10,0,32,Oh),lA=Xv.filter(Wv),Jr=aA.concat(Xv),Zp=`
`,qv="{YYYY}",uv=Zp+qv,Yv="{M}/{D}",Fl=Zp+Yv,Ih=Fl+"/{YY}",$v="{aa}",cA="{h}:{mm}",ra=cA+$v,hv=Zp+ra,dv=":{ss}",Ut=null;function Zv(n){let e=n*1e3,t=e*60,i=t*60,s=i*24,r=s*30,o=s*365,l=(n==1?zl(10,0,3,Oh).filter(Wv):zl(10,-3,0,Oh)).concat([e,e*5,e*10,e*15,e*30,t,t*5,t*10,t*15,t*30,i,i*2,i*3,i*4,i*6,i*8,i*12,s,s*2,s*3,s*4,s*5,s*6,s*7,s*8,s*9,s*10,s*15,r,r*2,r*3,r*4,r*6,o,o*2,o*5,o*10,o*25,o*50,o*100]),c=[[o,qv,Ut,Ut,Ut,Ut,Ut,Ut,1],[s*28,"{MMM}",uv,Ut,Ut,Ut,Ut,Ut,1],[s,Yv,uv,Ut,Ut,Ut,Ut,Ut,1],[i,"{h}"+$v,Ih,Ut,Fl,Ut,Ut,Ut,1],[t,ra,Ih,Ut,Fl,Ut,Ut,Ut,1],[e,dv,Ih+" "+ra,Ut,Fl+" "+ra,Ut,hv,Ut,1],[n,dv+".{fff}",Ih+" "+ra,Ut,Fl+" "+ra,Ut,hv,Ut,1]];function u(f){return(d,p,g,v,m,_)=>{let x=[],T=m>=o,S=m>=r&&m<o,R=f(g),C=qt(R*n,3),y=Cp(R.getFullYear(),T?0:R.getMonth(),S||T?1:R.getDate()),M=qt(y*n,3);if(S||T){let N=S?m/r:0,P=T?m/o:0,D=C==M?C:qt(Cp(y.getFullYear()+P,y.getMonth()+N,1)*n,3),z=new Date(Fn(D/n)),G=z.getFullYear(),U=z.getMonth();for(let W=0;D<=v;W++){let $=Cp(G+P*W,U+N*W,1),H=$-f(qt($*n,3));D=qt((+$+H)*n,3),D<=v&&x.push(D)}}else{let N=m>=s?s:m,P=Ni(g)-Ni(C),D=M+P+Bh(C-M,N);x.push(D);let z=f(D),G=z.getHours()+z.getMinutes()/t+z.getSeconds()/i,U=m/i,W=d.axes[p]._space,$=_/W;for(;D=qt(D+m,n==1?0:3),!(D>v);)if(U>1){let H=Ni(qt(G+U,6))%24,Q=f(D).getHours()-H;Q>1&&(Q=-1),D-=Q*i,G=(G+U)%24;let ie=x[x.length-1];qt((D-ie)/m,3)*$>=.7&&x.push(D)}else x.push(D)}return x}}return[l,c,u]}var[uA,hA,dA]=Zv(1),[fA,pA,mA]=Zv(.001);zl(2,-53,53,[1]);function fv(n,e){return n.map(t=>t.map((i,s)=>s==0||s==8||i==null?i:e(s==1||t[8]==0?i:t[1]+i)))}function pv(n,e){return(t,i,s,r,o)=>{let a=e.find(g=>o>=g[0])||e[e.length-1],l,c,u,f,d,p;return i.map(g=>{let v=n(g),m=v.getFullYear(),_=v.getMonth(),x=v.getDate(),T=v.getHours(),S=v.getMinutes(),R=v.getSeconds(),C=m!=l&&a[2]||_!=c&&a[3]||x!=u&&a[4]||T!=f&&a[5]||S!=d&&a[6]||R!=p&&a[7]||a[1];return l=m,c=_,u=x,f=T,d=S,p=R,C(v)})}}function gA(n,e){let t=$p(e);return(i,s,r,o,a)=>s.map(l=>t(n(l)))}function Cp(n,e,t){return new Date(n,e,t)}function mv(n,e){return e(n)}var _A="{YYYY}-{MM}-{DD} {h}:{mm}{aa}";function gv(n,e){return(t,i,s,r)=>r==null?Gp:e(n(i))}function vA(n,e){let t=n.series[e];return t.width?t.stroke(n,e):t.points.width?t.points.stroke(n,e):null}function xA(n,e){return n.series[e].fill(n,e)}var yA={show:!0,live:!0,isolate:!1,mount:BE,markers:{show:!0,width:2,stroke:vA,fill:xA,dash:"solid"},idx:null,idxs:null,values:[]};function bA(n,e){let t=n.cursor.points,i=Hi(),s=t.size(n,e);nn(i,Ul,s),nn(i,Ol,s);let r=s/-2;nn(i,"marginLeft",r),nn(i,"marginTop",r);let o=t.width(n,e,s);return o&&nn(i,"borderWidth",o),i}function SA(n,e){let t=n.series[e].points;return t._fill||t._stroke}function MA(n,e){let t=n.series[e].points;return t._stroke||t._fill}function wA(n,e){return n.series[e].points.size}var Rp=[0,0];function TA(n,e,t){return Rp[0]=e,Rp[1]=t,Rp}function Lh(n,e,t,i=!0){return s=>{s.button==0&&(!i||s.target==e)&&t(s)}}function Pp(n,e,t,i=!0){return s=>{(!i||s.target==e)&&t(s)}}var EA={show:!0,x:!0,y:!0,lock:!1,move:TA,points:{one:!1,show:bA,size:wA,width:0,stroke:MA,fill:SA},bind:{mousedown:Lh,mouseup:Lh,click:Lh,dblclick:Lh,mousemove:Pp,mouseleave:Pp,mouseenter:Pp},drag:{setScale:!0,x:!0,y:!1,dist:0,uni:null,click:(n,e)=>{e.stopPropagation(),e.stopImmediatePropagation()},_x:!1,_y:!1},focus:{dist:(n,e,t,i,s)=>i-s,prox:-1,bias:0},hover:{skip:[void 0],prox:null,bias:0},left:-10,top:-10,idx:null,dataIdx:null,idxs:null,event:null},Jv={show:!0,stroke:"rgba(0,0,0,0.07)",width:2},Jp=Pn({},Jv,{filter:Ov}),Kv=Pn({},Jp,{size:10}),jv=Pn({},Jv,{show:!1}),Kp='12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"',Qv="bold "+Kp,ex=1.5,_v={show:!0,scale:"x",stroke:Vp,space:50,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:Qv,side:2,grid:Jp,ticks:Kv,border:jv,font:Kp,lineGap:ex,rotate:0},AA="Value",CA="Time",vv={show:!0,scale:"x",auto:!1,sorted:1,min:Xt,max:-Xt,idxs:[]};function RA(n,e,t,i,s){return e.map(r=>r==null?"":qp(r))}function PA(n,e,t,i,s,r,o){let a=[],l=Tr.get(s)||0;t=o?t:qt(Bh(t,s),l);for(let c=t;c<=i;c=qt(c+s,l))a.push(Object.is(c,-0)?0:c);return a}function Op(n,e,t,i,s,r,o){let a=[],l=n.scales[n.axes[e].scale].log,c=l==10?$s:Dv,u=Ni(c(t));s=aa(l,u),l==10&&(s=Jr[cs(s,Jr)]);let f=t,d=s*l;l==10&&(d=Jr[cs(d,Jr)]);do a.push(f),f=f+s,l==10&&!Tr.has(f)&&(f=qt(f,Tr.get(s))),f>=d&&(s=f,d=s*l,l==10&&(d=Jr[cs(d,Jr)]));while(f<=i);return a}function IA(n,e,t,i,s,r,o){let l=n.scales[n.axes[e].scale].asinh,c=i>l?Op(n,e,gi(l,t),i,s):[l],u=i>=0&&t<=0?[0]:[];return(t<-l?Op(n,e,gi(l,-i),-t,s):[l]).reverse().map(d=>-d).concat(u,c)}var tx=/./,LA=/[12357]/,DA=/[125]/,xv=/1/,Fp=(n,e,t,i)=>n.map((s,r)=>e==4&&s==0||r%i==0&&t.test(s.toExponential()[s<0?1:0])?s:null);function NA(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=n.scales[o],l=n.valToPos,c=r._space,u=l(10,o),f=l(9,o)-u>=c?tx:l(7,o)-u>=c?LA:l(5,o)-u>=c?DA:xv;if(f==xv){let d=kn(l(1,o)-u);if(d<c)return Fp(e.slice().reverse(),a.distr,f,Wi(c/d)).reverse()}return Fp(e,a.distr,f,1)}function UA(n,e,t,i,s){let r=n.axes[t],o=r.scale,a=r._space,l=n.valToPos,c=kn(l(1,o)-l(2,o));return c<a?Fp(e.slice().reverse(),3,tx,Wi(a/c)).reverse():e}function OA(n,e,t,i){return i==null?Gp:e==null?"":qp(e)}var yv={show:!0,scale:"y",stroke:Vp,space:30,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:Qv,side:3,grid:Jp,ticks:Kv,border:jv,font:Kp,lineGap:ex,rotate:0};function FA(n,e){let t=3+(n||1)*2;return qt(t*e,3)}function kA(n,e){let{scale:t,idxs:i}=n.series[0],s=n._data[0],r=n.valToPos(s[i[0]],t,!0),o=n.valToPos(s[i[1]],t,!0),a=kn(o-r),l=n.series[e],c=a/(l.points.space*Lt);return i[1]-i[0]<=c}var bv={scale:null,auto:!0,sorted:0,min:Xt,max:-Xt},nx=(n,e,t,i,s)=>s,Sv={show:!0,auto:!0,sorted:0,gaps:nx,alpha:1,facets:[Pn({},bv,{scale:"x"}),Pn({},bv,{scale:"y"})]},Mv={scale:"y",auto:!0,sorted:0,show:!0,spanGaps:!1,gaps:nx,alpha:1,points:{show:kA,filter:null},values:null,min:Xt,max:-Xt,idxs:[],path:null,clip:null};function BA(n,e,t,i,s){return t/10}var ix={time:!0,auto:!0,distr:1,log:10,asinh:1,min:null,max:null,dir:1,ori:0},zA=Pn({},ix,{time:!1,ori:1}),wv={};function sx(n,e){let t=wv[n];return t||(t={key:n,plots:[],sub(i){t.plots.push(i)},unsub(i){t.plots=t.plots.filter(s=>s!=i)},pub(i,s,r,o,a,l,c){for(let u=0;u<t.plots.length;u++)t.plots[u]!=s&&t.plots[u].pub(i,s,r,o,a,l,c)}},n!=null&&(wv[n]=t)),t}var ua=1,kp=2;function eo(n,e,t){let i=n.mode,s=n.series[e],r=i==2?n._data[e]:n._data,o=n.scales,a=n.bbox,l=r[0],c=i==2?r[1]:r[e],u=i==2?o[s.facets[0].scale]:o[n.series[0].scale],f=i==2?o[s.facets[1].scale]:o[s.scale],d=a.left,p=a.top,g=a.width,v=a.height,m=n.valToPosH,_=n.valToPosV;return u.ori==0?t(s,l,c,u,f,m,_,d,p,g,v,Gh,da,Wh,ox,lx):t(s,l,c,u,f,_,m,p,d,v,g,Hh,fa,em,ax,cx)}function jp(n,e){let t=0,i=0,s=Rt(n.bands,Yp);for(let r=0;r<s.length;r++){let o=s[r];o.series[0]==e?t=o.dir:o.series[1]==e&&(o.dir==1?i|=1:i|=2)}return[t,i==1?-1:i==2?1:i==3?2:0]}function VA(n,e,t,i,s){let r=n.mode,o=n.series[e],a=r==2?o.facets[1].scale:o.scale,l=n.scales[a];return s==-1?l.min:s==1?l.max:l.distr==3?l.dir==1?l.min:l.max:0}function Zs(n,e,t,i,s,r){return eo(n,e,(o,a,l,c,u,f,d,p,g,v,m)=>{let _=o.pxRound,x=c.dir*(c.ori==0?1:-1),T=c.ori==0?da:fa,S,R;x==1?(S=t,R=i):(S=i,R=t);let C=_(f(a[S],c,v,p)),y=_(d(l[S],u,m,g)),M=_(f(a[R],c,v,p)),N=_(d(r==1?u.max:u.min,u,m,g)),P=new Path2D(s);return T(P,M,N),T(P,C,N),T(P,C,y),P})}function Vh(n,e,t,i,s,r){let o=null;if(n.length>0){o=new Path2D;let a=e==0?Wh:em,l=t;for(let f=0;f<n.length;f++){let d=n[f];if(d[1]>d[0]){let p=d[0]-l;p>0&&a(o,l,i,p,i+r),l=d[1]}}let c=t+s-l,u=10;c>0&&a(o,l,i-u/2,c,i+r+u)}return o}function GA(n,e,t){let i=n[n.length-1];i&&i[0]==e?i[1]=t:n.push([e,t])}function Qp(n,e,t,i,s,r,o){let a=[],l=n.length;for(let c=s==1?t:i;c>=t&&c<=i;c+=s)if(e[c]===null){let f=c,d=c;if(s==1)for(;++c<=i&&e[c]===null;)d=c;else for(;--c>=t&&e[c]===null;)d=c;let p=r(n[f]),g=d==f?p:r(n[d]),v=f-s;p=o<=0&&v>=0&&v<l?r(n[v]):p;let _=d+s;g=o>=0&&_>=0&&_<l?r(n[_]):g,g>=p&&a.push([p,g])}return a}function Tv(n){return n==0?Uv:n==1?Fn:e=>Zr(e,n)}function rx(n){let e=n==0?Gh:Hh,t=n==0?(s,r,o,a,l,c)=>{s.arcTo(r,o,a,l,c)}:(s,r,o,a,l,c)=>{s.arcTo(o,r,l,a,c)},i=n==0?(s,r,o,a,l)=>{s.rect(r,o,a,l)}:(s,r,o,a,l)=>{s.rect(o,r,l,a)};return(s,r,o,a,l,c=0,u=0)=>{c==0&&u==0?i(s,r,o,a,l):(c=us(c,a/2,l/2),u=us(u,a/2,l/2),e(s,r+c,o),t(s,r+a,o,r+a,o+l,c),t(s,r+a,o+l,r,o+l,u),t(s,r,o+l,r,o,u),t(s,r,o,r+a,o,c),s.closePath())}}var Gh=(n,e,t)=>{n.moveTo(e,t)},Hh=(n,e,t)=>{n.moveTo(t,e)},da=(n,e,t)=>{n.lineTo(e,t)},fa=(n,e,t)=>{n.lineTo(t,e)},Wh=rx(0),em=rx(1),ox=(n,e,t,i,s,r)=>{n.arc(e,t,i,s,r)},ax=(n,e,t,i,s,r)=>{n.arc(t,e,i,s,r)},lx=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(e,t,i,s,r,o)},cx=(n,e,t,i,s,r,o)=>{n.bezierCurveTo(t,e,s,i,o,r)};function ux(n){return(e,t,i,s,r)=>eo(e,t,(o,a,l,c,u,f,d,p,g,v,m)=>{let{pxRound:_,points:x}=o,T,S;c.ori==0?(T=Gh,S=ox):(T=Hh,S=ax);let R=qt(x.width*Lt,3),C=(x.size-x.width)/2*Lt,y=qt(C*2,3),M=new Path2D,N=new Path2D,{left:P,top:D,width:z,height:G}=e.bbox;Wh(N,P-y,D-y,z+y*2,G+y*2);let U=W=>{if(l[W]!=null){let $=_(f(a[W],c,v,p)),H=_(d(l[W],u,m,g));T(M,$+C,H),S(M,$,H,C,0,Dh*2)}};if(r)r.forEach(U);else for(let W=i;W<=s;W++)U(W);return{stroke:R>0?M:null,fill:M,clip:N,flags:ua|kp}})}function hx(n){return(e,t,i,s,r,o)=>{i!=s&&(r!=i&&o!=i&&n(e,t,i),r!=s&&o!=s&&n(e,t,s),n(e,t,o))}}var HA=hx(da),WA=hx(fa);function dx(n){let e=Rt(n?.alignGaps,0);return(t,i,s,r)=>eo(t,i,(o,a,l,c,u,f,d,p,g,v,m)=>{[s,r]=Fh(l,s,r);let _=o.pxRound,x=G=>_(f(G,c,v,p)),T=G=>_(d(G,u,m,g)),S,R;c.ori==0?(S=da,R=HA):(S=fa,R=WA);let C=c.dir*(c.ori==0?1:-1),y={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:ua},M=y.stroke,N=!1;if(r-s>=v*4){let G=de=>t.posToVal(de,c.key,!0),U=null,W=null,$,H,le,Y=x(a[C==1?s:r]),Q=x(a[s]),ie=x(a[r]),he=G(C==1?Q+1:ie-1);for(let de=C==1?s:r;de>=s&&de<=r;de+=C){let ee=a[de],xe=(C==1?ee<he:ee>he)?Y:x(ee),Re=l[de];xe==Y?Re!=null?(H=Re,U==null?(S(M,xe,T(H)),$=U=W=H):H<U?U=H:H>W&&(W=H)):Re===null&&(N=!0):(U!=null&&R(M,Y,T(U),T(W),T($),T(H)),Re!=null?(H=Re,S(M,xe,T(H)),U=W=$=H):(U=W=null,Re===null&&(N=!0)),Y=xe,he=G(Y+C))}U!=null&&U!=W&&le!=Y&&R(M,Y,T(U),T(W),T($),T(H))}else for(let G=C==1?s:r;G>=s&&G<=r;G+=C){let U=l[G];U===null?N=!0:U!=null&&S(M,x(a[G]),T(U))}let[D,z]=jp(t,i);if(o.fill!=null||D!=0){let G=y.fill=new Path2D(M),U=o.fillTo(t,i,o.min,o.max,D),W=T(U),$=x(a[s]),H=x(a[r]);C==-1&&([H,$]=[$,H]),S(G,H,W),S(G,$,W)}if(!o.spanGaps){let G=[];N&&G.push(...Qp(a,l,s,r,C,x,e)),y.gaps=G=o.gaps(t,i,s,r,G),y.clip=Vh(G,c.ori,p,g,v,m)}return z!=0&&(y.band=z==2?[Zs(t,i,s,r,M,-1),Zs(t,i,s,r,M,1)]:Zs(t,i,s,r,M,z)),y})}function XA(n){let e=Rt(n.align,1),t=Rt(n.ascDesc,!1),i=Rt(n.alignGaps,0),s=Rt(n.extend,!1);return(r,o,a,l)=>eo(r,o,(c,u,f,d,p,g,v,m,_,x,T)=>{[a,l]=Fh(f,a,l);let S=c.pxRound,{left:R,width:C}=r.bbox,y=Q=>S(g(Q,d,x,m)),M=Q=>S(v(Q,p,T,_)),N=d.ori==0?da:fa,P={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:ua},D=P.stroke,z=d.dir*(d.ori==0?1:-1),G=M(f[z==1?a:l]),U=y(u[z==1?a:l]),W=U,$=U;s&&e==-1&&($=R,N(D,$,G)),N(D,U,G);for(let Q=z==1?a:l;Q>=a&&Q<=l;Q+=z){let ie=f[Q];if(ie==null)continue;let he=y(u[Q]),de=M(ie);e==1?N(D,he,G):N(D,W,de),N(D,he,de),G=de,W=he}let H=W;s&&e==1&&(H=R+C,N(D,H,G));let[le,Y]=jp(r,o);if(c.fill!=null||le!=0){let Q=P.fill=new Path2D(D),ie=c.fillTo(r,o,c.min,c.max,le),he=M(ie);N(Q,H,he),N(Q,$,he)}if(!c.spanGaps){let Q=[];Q.push(...Qp(u,f,a,l,z,y,i));let ie=c.width*Lt/2,he=t||e==1?ie:-ie,de=t||e==-1?-ie:ie;Q.forEach(ee=>{ee[0]+=he,ee[1]+=de}),P.gaps=Q=c.gaps(r,o,a,l,Q),P.clip=Vh(Q,d.ori,m,_,x,T)}return Y!=0&&(P.band=Y==2?[Zs(r,o,a,l,D,-1),Zs(r,o,a,l,D,1)]:Zs(r,o,a,l,D,Y)),P})}function Ev(n,e,t,i,s,r,o=Xt){if(n.length>1){let a=null;for(let l=0,c=1/0;l<n.length;l++)if(e[l]!==void 0){if(a!=null){let u=kn(n[l]-n[a]);u<c&&(c=u,o=kn(t(n[l],i,s,r)-t(n[a],i,s,r)))}a=l}}return o}function qA(n){n=n||Bl;let e=Rt(n.size,[.6,Xt,1]),t=n.align||0,i=n.gap||0,s=n.radius;s=s==null?[0,0]:typeof s=="number"?[s,0]:s;let r=wt(s),o=1-e[0],a=Rt(e[1],Xt),l=Rt(e[2],1),c=Rt(n.disp,Bl),u=Rt(n.each,p=>{}),{fill:f,stroke:d}=c;return(p,g,v,m)=>eo(p,g,(_,x,T,S,R,C,y,M,N,P,D)=>{let z=_.pxRound,G=t,U=i*Lt,W=a*Lt,$=l*Lt,H,le;S.ori==0?[H,le]=r(p,g):[le,H]=r(p,g);let Y=S.dir*(S.ori==0?1:-1),Q=S.ori==0?Wh:em,ie=S.ori==0?u:(Ie,Ke,ct,we,Ht,He,Ze)=>{u(Ie,Ke,ct,Ht,we,Ze,He)},he=Rt(p.bands,Yp).find(Ie=>Ie.series[0]==g),de=he!=null?he.dir:0,ee=_.fillTo(p,g,_.min,_.max,de),ge=z(y(ee,R,D,N)),xe,Re,Me,Ye=P,lt=z(_.width*Lt),We=!1,gt=null,ft=null,rt=null,sn=null;f!=null&&(lt==0||d!=null)&&(We=!0,gt=f.values(p,g,v,m),ft=new Map,new Set(gt).forEach(Ie=>{Ie!=null&&ft.set(Ie,new Path2D)}),lt>0&&(rt=d.values(p,g,v,m),sn=new Map,new Set(rt).forEach(Ie=>{Ie!=null&&sn.set(Ie,new Path2D)})));let{x0:Yt,size:yn}=c;if(Yt!=null&&yn!=null){G=1,x=Yt.values(p,g,v,m),Yt.unit==2&&(x=x.map(ct=>p.posToVal(M+ct*P,S.key,!0)));let Ie=yn.values(p,g,v,m);yn.unit==2?Re=Ie[0]*P:Re=C(Ie[0],S,P,M)-C(0,S,P,M),Ye=Ev(x,T,C,S,P,M,Ye),Me=Ye-Re+U}else Ye=Ev(x,T,C,S,P,M,Ye),Me=Ye*o+U,Re=Ye-Me;Me<1&&(Me=0),lt>=Re/2&&(lt=0),Me<5&&(z=Uv);let Vt=Me>0,Bn=Ye-Me-(Vt?lt:0);Re=z(Up(Bn,$,W)),xe=(G==0?Re/2:G==Y?0:Re)-G*Y*((G==0?U/2:0)+(Vt?lt/2:0));let Tt={stroke:null,fill:null,clip:null,band:null,gaps:null,flags:0},In=We?null:new Path2D,cn=null;if(he!=null)cn=p.data[he.series[1]];else{let{y0:Ie,y1:Ke}=c;Ie!=null&&Ke!=null&&(T=Ke.values(p,g,v,m),cn=Ie.values(p,g,v,m))}let bn=H*Re,B=le*Re;for(let Ie=Y==1?v:m;Ie>=v&&Ie<=m;Ie+=Y){let Ke=T[Ie];if(Ke==null)continue;if(cn!=null){let q=cn[Ie]??0;if(Ke-q==0)continue;ge=y(q,R,D,N)}let ct=S.distr!=2||c!=null?x[Ie]:Ie,we=C(ct,S,P,M),Ht=y(Rt(Ke,ee),R,D,N),He=z(we-xe),Ze=z(gi(Ht,ge)),I=z(us(Ht,ge)),w=Ze-I;if(Ke!=null){let q=Ke<0?B:bn,ue=Ke<0?bn:B;We?(lt>0&&rt[Ie]!=null&&Q(sn.get(rt[Ie]),He,I+Ni(lt/2),Re,gi(0,w-lt),q,ue),gt[Ie]!=null&&Q(ft.get(gt[Ie]),He,I+Ni(lt/2),Re,gi(0,w-lt),q,ue)):Q(In,He,I+Ni(lt/2),Re,gi(0,w-lt),q,ue),ie(p,g,Ie,He-lt/2,I,Re+lt,w)}}return lt>0?Tt.stroke=We?sn:In:We||(Tt._fill=_.width==0?_._fill:_._stroke??_._fill,Tt.width=0),Tt.fill=We?ft:In,Tt})}function YA(n,e){let t=Rt(e?.alignGaps,0);return(i,s,r,o)=>eo(i,s,(a,l,c,u,f,d,p,g,v,m,_)=>{[r,o]=Fh(c,r,o);let x=a.pxRound,T=H=>x(d(H,u,m,g)),S=H=>x(p(H,f,_,v)),R,C,y;u.ori==0?(R=Gh,y=da,C=lx):(R=Hh,y=fa,C=cx);let M=u.dir*(u.ori==0?1:-1),N=T(l[M==1?r:o]),P=N,D=[],z=[];for(let H=M==1?r:o;H>=r&&H<=o;H+=M)if(c[H]!=null){let Y=l[H],Q=T(Y);D.push(P=Q),z.push(S(c[H]))}let G={stroke:n(D,z,R,y,C,x),fill:null,clip:null,band:null,gaps:null,flags:ua},U=G.stroke,[W,$]=jp(i,s);if(a.fill!=null||W!=0){let H=G.fill=new Path2D(U),le=a.fillTo(i,s,a.min,a.max,W),Y=S(le);y(H,P,Y),y(H,N,Y)}if(!a.spanGaps){let H=[];H.push(...Qp(l,c,r,o,M,T,t)),G.gaps=H=a.gaps(i,s,r,o,H),G.clip=Vh(H,u.ori,g,v,m,_)}return $!=0&&(G.band=$==2?[Zs(i,s,r,o,U,-1),Zs(i,s,r,o,U,1)]:Zs(i,s,r,o,U,$)),G})}function $A(n){return YA(ZA,n)}function ZA(n,e,t,i,s,r){let o=n.length;if(o<2)return null;let a=new Path2D;if(t(a,n[0],e[0]),o==2)i(a,n[1],e[1]);else{let l=Array(o),c=Array(o-1),u=Array(o-1),f=Array(o-1);for(let d=0;d<o-1;d++)u[d]=e[d+1]-e[d],f[d]=n[d+1]-n[d],c[d]=u[d]/f[d];l[0]=c[0];for(let d=1;d<o-1;d++)c[d]===0||c[d-1]===0||c[d-1]>0!=c[d]>0?l[d]=0:(l[d]=3*(f[d-1]+f[d])/((2*f[d]+f[d-1])/c[d-1]+(f[d]+2*f[d-1])/c[d]),isFinite(l[d])||(l[d]=0));l[o-1]=c[o-2];for(let d=0;d<o-1;d++)s(a,n[d]+f[d]/3,e[d]+l[d]*f[d]/3,n[d+1]-f[d]/3,e[d+1]-l[d+1]*f[d]/3,n[d+1],e[d+1])}return a}var Bp=new Set;function Av(){for(let n of Bp)n.syncRect(!0)}ha&&(jr(RE,oa,Av),jr(PE,oa,Av,!0),jr(Nh,oa,()=>{xn.pxRatio=Lt}));var JA=dx(),KA=ux();function Cv(n,e,t,i){return(i?[n[0],n[1]].concat(n.slice(2)):[n[0]].concat(n.slice(1))).map((r,o)=>zp(r,o,e,t))}function jA(n,e){return n.map((t,i)=>i==0?{}:Pn({},e,t))}function zp(n,e,t,i){return Pn({},e==0?t:i,n)}function fx(n,e,t){return e==null?la:[e,t]}var QA=fx;function eC(n,e,t){return e==null?la:Uh(e,t,Xp,!0)}function px(n,e,t,i){return e==null?la:kh(e,t,n.scales[i].log,!1)}var tC=px;function mx(n,e,t,i){return e==null?la:Wp(e,t,n.scales[i].log,!1)}var nC=mx;function iC(n,e,t,i,s){let r=gi(ov(n),ov(e)),o=e-n,a=cs(s/i*o,t);do{let l=t[a],c=i*l/o;if(c>=s&&r+(l<5?Tr.get(l):0)<=17)return[l,c]}while(++a<t.length);return[0,0]}function Rv(n){let e,t;return n=n.replace(/(\d+)px/,(i,s)=>(e=Fn((t=+s)*Lt))+"px"),[n,e,t]}function sC(n){n.show&&[n.font,n.labelFont].forEach(e=>{let t=qt(e[2]*Lt,1);e[0]=e[0].replace(/[0-9.]+px/,t+"px"),e[1]=t})}function xn(n,e,t){let i={mode:Rt(n.mode,1)},s=i.mode;function r(b,E,L,F){let X=E.valToPct(b);return F+L*(E.dir==-1?1-X:X)}function o(b,E,L,F){let X=E.valToPct(b);return F+L*(E.dir==-1?X:1-X)}function a(b,E,L,F){return E.ori==0?r(b,E,L,F):o(b,E,L,F)}i.valToPosH=r,i.valToPosV=o;let l=!1;i.status=0;let c=i.root=Hi(hE);if(n.id!=null&&(c.id=n.id),Di(c,n.class),n.title){let b=Hi(pE,c);b.textContent=n.title}let u=ls("canvas"),f=i.ctx=u.getContext("2d"),d=Hi(mE,c);jr("click",d,b=>{b.target===g&&(Jt!=ao||rn!=lo)&&Yn.click(i,b)},!0);let p=i.under=Hi(gE,d);d.appendChild(u);let g=i.over=Hi(_E,d);n=ca(n);let v=+Rt(n.pxAlign,1),m=Tv(v);(n.plugins||[]).forEach(b=>{b.opts&&(n=b.opts(i,n)||n)});let _=n.ms||.001,x=i.series=s==1?Cv(n.series||[],vv,Mv,!1):jA(n.series||[null],Sv),T=i.axes=Cv(n.axes||[],_v,yv,!0),S=i.scales={},R=i.bands=n.bands||[];R.forEach(b=>{b.fill=wt(b.fill||null),b.dir=Rt(b.dir,-1)});let C=s==2?x[1].facets[0].scale:x[0].scale,y={axes:Ds,series:vt},M=(n.drawOrder||["axes","series"]).map(b=>y[b]);function N(b){let E=b.distr==3?L=>$s(L>0?L:b.clamp(i,L,b.min,b.max,b.key)):b.distr==4?L=>Ap(L,b.asinh):b.distr==100?L=>b.fwd(L):L=>L;return L=>{let F=E(L),{_min:X,_max:K}=b,ae=K-X;return(F-X)/ae}}function P(b){let E=S[b];if(E==null){let L=(n.scales||Bl)[b]||Bl;if(L.from!=null){P(L.from);let F=Pn({},S[L.from],L,{key:b});F.valToPct=N(F),S[b]=F}else{E=S[b]=Pn({},b==C?ix:zA,L),E.key=b;let F=E.time,X=E.range,K=wr(X);if((b!=C||s==2&&!F)&&(K&&(X[0]==null||X[1]==null)&&(X={min:X[0]==null?iv:{mode:1,hard:X[0],soft:X[0]},max:X[1]==null?iv:{mode:1,hard:X[1],soft:X[1]}},K=!1),!K&&zh(X))){let ae=X;X=(fe,be,Oe)=>be==null?la:Uh(be,Oe,ae)}E.range=wt(X||(F?QA:b==C?E.distr==3?tC:E.distr==4?nC:fx:E.distr==3?px:E.distr==4?mx:eC)),E.auto=wt(K?!1:E.auto),E.clamp=wt(E.clamp||BA),E._min=E._max=null,E.valToPct=N(E)}}}P("x"),P("y"),s==1&&x.forEach(b=>{P(b.scale)}),T.forEach(b=>{P(b.scale)});for(let b in n.scales)P(b);let D=S[C],z=D.distr,G,U;D.ori==0?(Di(c,dE),G=r,U=o):(Di(c,fE),G=o,U=r);let W={};for(let b in S){let E=S[b];(E.min!=null||E.max!=null)&&(W[b]={min:E.min,max:E.max},E.min=E.max=null)}let $=n.tzDate||(b=>new Date(Fn(b/_))),H=n.fmtDate||$p,le=_==1?dA($):mA($),Y=pv($,fv(_==1?hA:pA,H)),Q=gv($,mv(_A,H)),ie=[],he=i.legend=Pn({},yA,n.legend),de=i.cursor=Pn({},EA,{drag:{y:s==2}},n.cursor),ee=he.show,ge=de.show,xe=he.markers;he.idxs=ie,xe.width=wt(xe.width),xe.dash=wt(xe.dash),xe.stroke=wt(xe.stroke),xe.fill=wt(xe.fill);let Re,Me,Ye,lt=[],We=[],gt,ft=!1,rt={};if(he.live){let b=x[1]?x[1].values:null;ft=b!=null,gt=ft?b(i,1,0):{_:0};for(let E in gt)rt[E]=Gp}if(ee)if(Re=ls("table",ME,c),Ye=ls("tbody",null,Re),he.mount(i,Re),ft){Me=ls("thead",null,Re,Ye);let b=ls("tr",null,Me);ls("th",null,b);for(var sn in gt)ls("th",W0,b).textContent=sn}else Di(Re,TE),he.live&&Di(Re,wE);let Yt={show:!0},yn={show:!1};function Vt(b,E){if(E==0&&(ft||!he.live||s==2))return la;let L=[],F=ls("tr",EE,Ye,Ye.childNodes[E]);Di(F,b.class),b.show||Di(F,Kr);let X=ls("th",null,F);if(xe.show){let fe=Hi(AE,X);if(E>0){let be=xe.width(i,E);be&&(fe.style.border=be+"px "+xe.dash(i,E)+" "+xe.stroke(i,E)),fe.style.background=xe.fill(i,E)}}let K=Hi(W0,X);b.label instanceof HTMLElement?K.appendChild(b.label):K.textContent=b.label,E>0&&(xe.show||(K.style.color=b.width>0?xe.stroke(i,E):xe.fill(i,E)),Tt("click",X,fe=>{if(de._lock)return;et(fe);let be=x.indexOf(b);if((fe.ctrlKey||fe.metaKey)!=he.isolate){let Oe=x.some((Fe,Be)=>Be>0&&Be!=be&&Fe.show);x.forEach((Fe,Be)=>{Be>0&&ms(Be,Oe?Be==be?Yt:yn:Yt,!0,Tn.setSeries)})}else ms(be,{show:!b.show},!0,Tn.setSeries)},!1),tt&&Tt($0,X,fe=>{de._lock||(et(fe),ms(x.indexOf(b),uo,!0,Tn.setSeries))},!1));for(var ae in gt){let fe=ls("td",CE,F);fe.textContent="--",L.push(fe)}return[F,L]}let Bn=new Map;function Tt(b,E,L,F=!0){let X=Bn.get(E)||{},K=de.bind[b](i,E,L,F);K&&(jr(b,E,X[b]=K),Bn.set(E,X))}function In(b,E,L){let F=Bn.get(E)||{};for(let X in F)(b==null||X==b)&&(Np(X,E,F[X]),delete F[X]);b==null&&Bn.delete(E)}let cn=0,bn=0,B=0,Ie=0,Ke=0,ct=0,we=Ke,Ht=ct,He=B,Ze=Ie,I=0,w=0,q=0,ue=0;i.bbox={};let oe=!1,ve=!1,ye=!1,te=!1,se=!1,pe=!1;function k(b,E,L){(L||b!=i.width||E!=i.height)&&re(b,E),pt(!1),ye=!0,ve=!0,Qn()}function re(b,E){i.width=cn=B=b,i.height=bn=Ie=E,Ke=ct=0,Se(),qe();let L=i.bbox;I=L.left=Zr(Ke*Lt,.5),w=L.top=Zr(ct*Lt,.5),q=L.width=Zr(B*Lt,.5),ue=L.height=Zr(Ie*Lt,.5)}let ne=3;function Te(){let b=!1,E=0;for(;!b;){E++;let L=so(E),F=ps(E);b=E==ne||L&&F,b||(re(i.width,i.height),ve=!0)}}function _e({width:b,height:E}){k(b,E)}i.setSize=_e;function Se(){let b=!1,E=!1,L=!1,F=!1;T.forEach((X,K)=>{if(X.show&&X._show){let{side:ae,_size:fe}=X,be=ae%2,Oe=X.label!=null?X.labelSize:0,Fe=fe+Oe;Fe>0&&(be?(B-=Fe,ae==3?(Ke+=Fe,F=!0):L=!0):(Ie-=Fe,ae==0?(ct+=Fe,b=!0):E=!0))}}),ds[0]=b,ds[1]=L,ds[2]=E,ds[3]=F,B-=qi[1]+qi[3],Ke+=qi[3],Ie-=qi[2]+qi[0],ct+=qi[0]}function qe(){let b=Ke+B,E=ct+Ie,L=Ke,F=ct;function X(K,ae){switch(K){case 1:return b+=ae,b-ae;case 2:return E+=ae,E-ae;case 3:return L-=ae,L+ae;case 0:return F-=ae,F+ae}}T.forEach((K,ae)=>{if(K.show&&K._show){let fe=K.side;K._pos=X(fe,K._size),K.label!=null&&(K._lpos=X(fe,K.labelSize))}})}if(de.dataIdx==null){let b=de.hover,E=b.skip=new Set(b.skip??[]);E.add(void 0);let L=b.prox=wt(b.prox),F=b.bias??=0;de.dataIdx=(X,K,ae,fe)=>{if(K==0)return ae;let be=ae,Oe=L(X,K,ae,fe)??Xt,Fe=Oe>=0&&Oe<Xt,Be=D.ori==0?B:Ie,ot=de.left,Pt=e[0],At=e[K];if(E.has(At[ae])){be=null;let yt=null,je=null,$e;if(F==0||F==-1)for($e=ae;yt==null&&$e-- >0;)E.has(At[$e])||(yt=$e);if(F==0||F==1)for($e=ae;je==null&&$e++<At.length;)E.has(At[$e])||(je=$e);if(yt!=null||je!=null)if(Fe){let jt=yt==null?-1/0:G(Pt[yt],D,Be,0),dn=je==null?1/0:G(Pt[je],D,Be,0),Hn=ot-jt,Gt=dn-ot;Hn<=Gt?Hn<=Oe&&(be=yt):Gt<=Oe&&(be=je)}else be=je==null?yt:yt==null?je:ae-yt<=je-ae?yt:je}else Fe&&kn(ot-G(Pt[ae],D,Be,0))>Oe&&(be=null);return be}}let et=b=>{de.event=b};de.idxs=ie,de._lock=!1;let ce=de.points;ce.show=wt(ce.show),ce.size=wt(ce.size),ce.stroke=wt(ce.stroke),ce.width=wt(ce.width),ce.fill=wt(ce.fill);let ze=i.focus=Pn({},n.focus||{alpha:.3},de.focus),tt=ze.prox>=0,Pe=tt&&ce.one,dt=[],Zt=[],ii=[];function ga(b,E){let L=ce.show(i,E);if(L instanceof HTMLElement)return Di(L,SE),Di(L,b.class),Cs(L,-10,-10,B,Ie),g.insertBefore(L,dt[E]),L}function to(b,E){if(s==1||E>0){let L=s==1&&S[b.scale].time,F=b.value;b.value=L?cv(F)?gv($,mv(F,H)):F||Q:F||OA,b.label=b.label||(L?CA:AA)}if(Pe||E>0){b.width=b.width==null?1:b.width,b.paths=b.paths||JA||zE,b.fillTo=wt(b.fillTo||VA),b.pxAlign=+Rt(b.pxAlign,v),b.pxRound=Tv(b.pxAlign),b.stroke=wt(b.stroke||null),b.fill=wt(b.fill||null),b._stroke=b._fill=b._paths=b._focus=null;let L=FA(gi(1,b.width),1),F=b.points=Pn({},{size:L,width:gi(1,L*.2),stroke:b.stroke,space:L*2,paths:KA,_stroke:null,_fill:null},b.points);F.show=wt(F.show),F.filter=wt(F.filter),F.fill=wt(F.fill),F.stroke=wt(F.stroke),F.paths=wt(F.paths),F.pxAlign=b.pxAlign}if(ee){let L=Vt(b,E);lt.splice(E,0,L[0]),We.splice(E,0,L[1]),he.values.push(null)}if(ge){ie.splice(E,0,null);let L=null;Pe?E==0&&(L=ga(b,E)):E>0&&(L=ga(b,E)),dt.splice(E,0,L),Zt.splice(E,0,0),ii.splice(E,0,0)}Gn("addSeries",E)}function sd(b,E){E=E??x.length,b=s==1?zp(b,E,vv,Mv):zp(b,E,{},Sv),x.splice(E,0,b),to(x[E],E)}i.addSeries=sd;function Gl(b){if(x.splice(b,1),ee){he.values.splice(b,1),We.splice(b,1);let E=lt.splice(b,1)[0];In(null,E.firstChild),E.remove()}ge&&(ie.splice(b,1),dt.splice(b,1)[0].remove(),Zt.splice(b,1),ii.splice(b,1)),Gn("delSeries",b)}i.delSeries=Gl;let ds=[!1,!1,!1,!1];function Ps(b,E){if(b._show=b.show,b.show){let L=b.side%2,F=S[b.scale];F==null&&(b.scale=L?x[1].scale:C,F=S[b.scale]);let X=F.time;b.size=wt(b.size),b.space=wt(b.space),b.rotate=wt(b.rotate),wr(b.incrs)&&b.incrs.forEach(ae=>{!Tr.has(ae)&&Tr.set(ae,kv(ae))}),b.incrs=wt(b.incrs||(F.distr==2?lA:X?_==1?uA:fA:Jr)),b.splits=wt(b.splits||(X&&F.distr==1?le:F.distr==3?Op:F.distr==4?IA:PA)),b.stroke=wt(b.stroke),b.grid.stroke=wt(b.grid.stroke),b.ticks.stroke=wt(b.ticks.stroke),b.border.stroke=wt(b.border.stroke);let K=b.values;b.values=wr(K)&&!wr(K[0])?wt(K):X?wr(K)?pv($,fv(K,H)):cv(K)?gA($,K):K||Y:K||RA,b.filter=wt(b.filter||(F.distr>=3&&F.log==10?NA:F.distr==3&&F.log==2?UA:Ov)),b.font=Rv(b.font),b.labelFont=Rv(b.labelFont),b._size=b.size(i,null,E,0),b._space=b._rotate=b._incrs=b._found=b._splits=b._values=null,b._size>0&&(ds[E]=!0,b._el=Hi(vE,d))}}function Is(b,E,L,F){let[X,K,ae,fe]=L,be=E%2,Oe=0;return be==0&&(fe||K)&&(Oe=E==0&&!X||E==2&&!ae?Fn(_v.size/3):0),be==1&&(X||ae)&&(Oe=E==1&&!K||E==3&&!fe?Fn(yv.size/2):0),Oe}let _a=i.padding=(n.padding||[Is,Is,Is,Is]).map(b=>wt(Rt(b,Is))),qi=i._padding=_a.map((b,E)=>b(i,E,ds,0)),un,gn=null,_n=null,fs=s==1?x[0].idxs:null,Si=null,Ks=!1;function va(b,E){if(e=b??[],i.data=i._data=e,s==2){un=0;for(let L=1;L<x.length;L++)un+=e[L][0].length}else{e.length==0&&(i.data=i._data=e=[[]]),Si=e[0],un=Si.length;let L=e;if(z==2){L=e.slice();let F=L[0]=Array(un);for(let X=0;X<un;X++)F[X]=X}i._data=e=L}if(pt(!0),Gn("setData"),z==2&&(ye=!0),E!==!1){let L=D;L.auto(i,Ks)?xa():er(C,L.min,L.max),te=te||de.left>=0,pe=!0,Qn()}}i.setData=va;function xa(){Ks=!0;let b,E;s==1&&(un>0?(gn=fs[0]=0,_n=fs[1]=un-1,b=e[0][gn],E=e[0][_n],z==2?(b=gn,E=_n):b==E&&(z==3?[b,E]=kh(b,b,D.log,!1):z==4?[b,E]=Wp(b,b,D.log,!1):D.time?E=b+Fn(86400/_):[b,E]=Uh(b,E,Xp,!0))):(gn=fs[0]=b=null,_n=fs[1]=E=null)),er(C,b,E)}let no,js,io,A,V,j,Z,J,Ee,De;function Ae(b,E,L,F,X,K){b??=q0,L??=Yp,F??="butt",X??=q0,K??="round",b!=no&&(f.strokeStyle=no=b),X!=js&&(f.fillStyle=js=X),E!=io&&(f.lineWidth=io=E),K!=V&&(f.lineJoin=V=K),F!=j&&(f.lineCap=j=F),L!=A&&f.setLineDash(A=L)}function Ue(b,E,L,F){E!=js&&(f.fillStyle=js=E),b!=Z&&(f.font=Z=b),L!=J&&(f.textAlign=J=L),F!=Ee&&(f.textBaseline=Ee=F)}function Ge(b,E,L,F,X=0){if(F.length>0&&b.auto(i,Ks)&&(E==null||E.min==null)){let K=Rt(gn,0),ae=Rt(_n,F.length-1),fe=L.min==null?NE(F,K,ae,X,b.distr==3):[L.min,L.max];b.min=us(b.min,L.min=fe[0]),b.max=gi(b.max,L.max=fe[1])}}let nt={min:null,max:null};function _t(){for(let F in S){let X=S[F];W[F]==null&&(X.min==null||W[C]!=null&&X.auto(i,Ks))&&(W[F]=nt)}for(let F in S){let X=S[F];W[F]==null&&X.from!=null&&W[X.from]!=null&&(W[F]=nt)}W[C]!=null&&pt(!0);let b={};for(let F in W){let X=W[F];if(X!=null){let K=b[F]=ca(S[F],HE);if(X.min!=null)Pn(K,X);else if(F!=C||s==2)if(un==0&&K.from==null){let ae=K.range(i,null,null,F);K.min=ae[0],K.max=ae[1]}else K.min=Xt,K.max=-Xt}}if(un>0){x.forEach((F,X)=>{if(s==1){let K=F.scale,ae=W[K];if(ae==null)return;let fe=b[K];if(X==0){let be=fe.range(i,fe.min,fe.max,K);fe.min=be[0],fe.max=be[1],gn=cs(fe.min,e[0]),_n=cs(fe.max,e[0]),_n-gn>1&&(e[0][gn]<fe.min&&gn++,e[0][_n]>fe.max&&_n--),F.min=Si[gn],F.max=Si[_n]}else F.show&&F.auto&&Ge(fe,ae,F,e[X],F.sorted);F.idxs[0]=gn,F.idxs[1]=_n}else if(X>0&&F.show&&F.auto){let[K,ae]=F.facets,fe=K.scale,be=ae.scale,[Oe,Fe]=e[X],Be=b[fe],ot=b[be];Be!=null&&Ge(Be,W[fe],K,Oe,K.sorted),ot!=null&&Ge(ot,W[be],ae,Fe,ae.sorted),F.min=ae.min,F.max=ae.max}});for(let F in b){let X=b[F],K=W[F];if(X.from==null&&(K==null||K.min==null)){let ae=X.range(i,X.min==Xt?null:X.min,X.max==-Xt?null:X.max,F);X.min=ae[0],X.max=ae[1]}}}for(let F in b){let X=b[F];if(X.from!=null){let K=b[X.from];if(K.min==null)X.min=X.max=null;else{let ae=X.range(i,K.min,K.max,F);X.min=ae[0],X.max=ae[1]}}}let E={},L=!1;for(let F in b){let X=b[F],K=S[F];if(K.min!=X.min||K.max!=X.max){K.min=X.min,K.max=X.max;let ae=K.distr;K._min=ae==3?$s(K.min):ae==4?Ap(K.min,K.asinh):ae==100?K.fwd(K.min):K.min,K._max=ae==3?$s(K.max):ae==4?Ap(K.max,K.asinh):ae==100?K.fwd(K.max):K.max,E[F]=L=!0}}if(L){x.forEach((F,X)=>{s==2?X>0&&E.y&&(F._paths=null):E[F.scale]&&(F._paths=null)});for(let F in E)ye=!0,Gn("setScale",F);ge&&de.left>=0&&(te=pe=!0)}for(let F in W)W[F]=null}function Ve(b){let E=Up(gn-1,0,un-1),L=Up(_n+1,0,un-1);for(;b[E]==null&&E>0;)E--;for(;b[L]==null&&L<un-1;)L++;return[E,L]}function vt(){if(un>0){let b=x.some(E=>E._focus)&&De!=ze.alpha;b&&(f.globalAlpha=De=ze.alpha),x.forEach((E,L)=>{if(L>0&&E.show&&(an(L,!1),an(L,!0),E._paths==null)){let F=De;De!=E.alpha&&(f.globalAlpha=De=E.alpha);let X=s==2?[0,e[L][0].length-1]:Ve(e[L]);E._paths=E.paths(i,L,X[0],X[1]),De!=F&&(f.globalAlpha=De=F)}}),x.forEach((E,L)=>{if(L>0&&E.show){let F=De;De!=E.alpha&&(f.globalAlpha=De=E.alpha),E._paths!=null&&Ot(L,!1);{let X=E._paths!=null?E._paths.gaps:null,K=E.points.show(i,L,gn,_n,X),ae=E.points.filter(i,L,K,X);(K||ae)&&(E.points._paths=E.points.paths(i,L,gn,_n,ae),Ot(L,!0))}De!=F&&(f.globalAlpha=De=F),Gn("drawSeries",L)}}),b&&(f.globalAlpha=De=1)}}function an(b,E){let L=E?x[b].points:x[b];L._stroke=L.stroke(i,b),L._fill=L.fill(i,b)}function Ot(b,E){let L=E?x[b].points:x[b],{stroke:F,fill:X,clip:K,flags:ae,_stroke:fe=L._stroke,_fill:be=L._fill,_width:Oe=L.width}=L._paths;Oe=qt(Oe*Lt,3);let Fe=null,Be=Oe%2/2;E&&be==null&&(be=Oe>0?"#fff":fe);let ot=L.pxAlign==1&&Be>0;if(ot&&f.translate(Be,Be),!E){let Pt=I-Oe/2,At=w-Oe/2,yt=q+Oe,je=ue+Oe;Fe=new Path2D,Fe.rect(Pt,At,yt,je)}E?ke(fe,Oe,L.dash,L.cap,be,F,X,ae,K):Ft(b,fe,Oe,L.dash,L.cap,be,F,X,ae,Fe,K),ot&&f.translate(-Be,-Be)}function Ft(b,E,L,F,X,K,ae,fe,be,Oe,Fe){let Be=!1;be!=0&&R.forEach((ot,Pt)=>{if(ot.series[0]==b){let At=x[ot.series[1]],yt=e[ot.series[1]],je=(At._paths||Bl).band;wr(je)&&(je=ot.dir==1?je[0]:je[1]);let $e,jt=null;At.show&&je&&OE(yt,gn,_n)?(jt=ot.fill(i,Pt)||K,$e=At._paths.clip):je=null,ke(E,L,F,X,jt,ae,fe,be,Oe,Fe,$e,je),Be=!0}}),Be||ke(E,L,F,X,K,ae,fe,be,Oe,Fe)}let Ln=ua|kp;function ke(b,E,L,F,X,K,ae,fe,be,Oe,Fe,Be){Ae(b,E,L,F,X),(be||Oe||Be)&&(f.save(),be&&f.clip(be),Oe&&f.clip(Oe)),Be?(fe&Ln)==Ln?(f.clip(Be),Fe&&f.clip(Fe),bt(X,ae),Sn(b,K,E)):fe&kp?(bt(X,ae),f.clip(Be),Sn(b,K,E)):fe&ua&&(f.save(),f.clip(Be),Fe&&f.clip(Fe),bt(X,ae),f.restore(),Sn(b,K,E)):(bt(X,ae),Sn(b,K,E)),(be||Oe||Be)&&f.restore()}function Sn(b,E,L){L>0&&(E instanceof Map?E.forEach((F,X)=>{f.strokeStyle=no=X,f.stroke(F)}):E!=null&&b&&f.stroke(E))}function bt(b,E){E instanceof Map?E.forEach((L,F)=>{f.fillStyle=js=F,f.fill(L)}):E!=null&&b&&f.fill(E)}function Ls(b,E,L,F){let X=T[b],K;if(F<=0)K=[0,0];else{let ae=X._space=X.space(i,b,E,L,F),fe=X._incrs=X.incrs(i,b,E,L,F,ae);K=iC(E,L,fe,F,ae)}return X._found=K}function Mn(b,E,L,F,X,K,ae,fe,be,Oe){let Fe=ae%2/2;v==1&&f.translate(Fe,Fe),Ae(fe,ae,be,Oe,fe),f.beginPath();let Be,ot,Pt,At,yt=X+(F==0||F==3?-K:K);L==0?(ot=X,At=yt):(Be=X,Pt=yt);for(let je=0;je<b.length;je++)E[je]!=null&&(L==0?Be=Pt=b[je]:ot=At=b[je],f.moveTo(Be,ot),f.lineTo(Pt,At));f.stroke(),v==1&&f.translate(-Fe,-Fe)}function so(b){let E=!0;return T.forEach((L,F)=>{if(!L.show)return;let X=S[L.scale];if(X.min==null){L._show&&(E=!1,L._show=!1,pt(!1));return}else L._show||(E=!1,L._show=!0,pt(!1));let K=L.side,ae=K%2,{min:fe,max:be}=X,[Oe,Fe]=Ls(F,fe,be,ae==0?B:Ie);if(Fe==0)return;let Be=X.distr==2,ot=L._splits=L.splits(i,F,fe,be,Oe,Fe,Be),Pt=X.distr==2?ot.map($e=>Si[$e]):ot,At=X.distr==2?Si[ot[1]]-Si[ot[0]]:Oe,yt=L._values=L.values(i,L.filter(i,Pt,F,Fe,At),F,Fe,At);L._rotate=K==2?L.rotate(i,yt,F,Fe):0;let je=L._size;L._size=Wi(L.size(i,yt,F,b)),je!=null&&L._size!=je&&(E=!1)}),E}function ps(b){let E=!0;return _a.forEach((L,F)=>{let X=L(i,F,ds,b);X!=qi[F]&&(E=!1),qi[F]=X}),E}function Ds(){for(let b=0;b<T.length;b++){let E=T[b];if(!E.show||!E._show)continue;let L=E.side,F=L%2,X,K,ae=E.stroke(i,b),fe=L==0||L==3?-1:1,[be,Oe]=E._found;if(E.label!=null){let oi=E.labelGap*fe,Ti=Fn((E._lpos+oi)*Lt);Ue(E.labelFont[0],ae,"center",L==2?"top":X0),f.save(),F==1?(X=K=0,f.translate(Ti,Fn(w+ue/2)),f.rotate((L==3?-Dh:Dh)/2)):(X=Fn(I+q/2),K=Ti);let Cr=Nv(E.label)?E.label(i,b,be,Oe):E.label;f.fillText(Cr,X,K),f.restore()}if(Oe==0)continue;let Fe=S[E.scale],Be=F==0?q:ue,ot=F==0?I:w,Pt=E._splits,At=Fe.distr==2?Pt.map(oi=>Si[oi]):Pt,yt=Fe.distr==2?Si[Pt[1]]-Si[Pt[0]]:be,je=E.ticks,$e=E.border,jt=je.show?je.size:0,dn=Fn(jt*Lt),Hn=Fn((E.alignTo==2?E._size-jt-E.gap:E.gap)*Lt),Gt=E._rotate*-Dh/180,fn=m(E._pos*Lt),Mi=(dn+Hn)*fe,ri=fn+Mi;K=F==0?ri:0,X=F==1?ri:0;let Oi=E.font[0],Yi=E.align==1?sa:E.align==2?wp:Gt>0?sa:Gt<0?wp:F==0?"center":L==3?wp:sa,_s=Gt||F==1?"middle":L==2?"top":X0;Ue(Oi,ae,Yi,_s);let wi=E.font[1]*E.lineGap,Fi=Pt.map(oi=>m(a(oi,Fe,Be,ot))),$i=E._values;for(let oi=0;oi<$i.length;oi++){let Ti=$i[oi];if(Ti!=null){F==0?X=Fi[oi]:K=Fi[oi],Ti=""+Ti;let Cr=Ti.indexOf(`
`)==-1?[Ti]:Ti.split(/\n/gm);for(let ai=0;ai<Cr.length;ai++){let Dm=Cr[ai];Gt?(f.save(),f.translate(X,K+ai*wi),f.rotate(Gt),f.fillText(Dm,0,0),f.restore()):f.fillText(Dm,X,K+ai*wi)}}}je.show&&Mn(Fi,je.filter(i,At,b,Oe,yt),F,L,fn,dn,qt(je.width*Lt,3),je.stroke(i,b),je.dash,je.cap);let vs=E.grid;vs.show&&Mn(Fi,vs.filter(i,At,b,Oe,yt),F,F==0?2:1,F==0?w:I,F==0?ue:q,qt(vs.width*Lt,3),vs.stroke(i,b),vs.dash,vs.cap),$e.show&&Mn([fn],[1],F==0?1:0,F==0?1:2,F==1?w:I,F==1?ue:q,qt($e.width*Lt,3),$e.stroke(i,b),$e.dash,$e.cap)}Gn("drawAxes")}function pt(b){x.forEach((E,L)=>{L>0&&(E._paths=null,b&&(s==1?(E.min=null,E.max=null):E.facets.forEach(F=>{F.min=null,F.max=null})))})}let hn=!1,si=!1,kt=[];function wn(){si=!1;for(let b=0;b<kt.length;b++)Gn(...kt[b]);kt.length=0}function Qn(){hn||(JE(mm),hn=!0)}function Hl(b,E=!1){hn=!0,si=E,b(i),mm(),E&&kt.length>0&&queueMicrotask(wn)}i.batch=Hl;function mm(){if(oe&&(_t(),oe=!1),ye&&(Te(),ye=!1),ve){if(nn(p,sa,Ke),nn(p,"top",ct),nn(p,Ul,B),nn(p,Ol,Ie),nn(g,sa,Ke),nn(g,"top",ct),nn(g,Ul,B),nn(g,Ol,Ie),nn(d,Ul,cn),nn(d,Ol,bn),u.width=Fn(cn*Lt),u.height=Fn(bn*Lt),T.forEach(({_el:b,_show:E,_size:L,_pos:F,side:X})=>{if(b!=null)if(E){let K=X===3||X===0?L:0,ae=X%2==1;nn(b,ae?"left":"top",F-K),nn(b,ae?"width":"height",L),nn(b,ae?"top":"left",ae?ct:Ke),nn(b,ae?"height":"width",ae?Ie:B),Dp(b,Kr)}else Di(b,Kr)}),no=js=io=V=j=Z=J=Ee=A=null,De=1,Sa(!0),Ke!=we||ct!=Ht||B!=He||Ie!=Ze){pt(!1);let b=B/He,E=Ie/Ze;if(ge&&!te&&de.left>=0){de.left*=b,de.top*=E,ro&&Cs(ro,Fn(de.left),0,B,Ie),oo&&Cs(oo,0,Fn(de.top),B,Ie);for(let L=0;L<dt.length;L++){let F=dt[L];F!=null&&(Zt[L]*=b,ii[L]*=E,Cs(F,Wi(Zt[L]),Wi(ii[L]),B,Ie))}}if(Kt.show&&!se&&Kt.left>=0&&Kt.width>0){Kt.left*=b,Kt.width*=b,Kt.top*=E,Kt.height*=E;for(let L in ud)nn(co,L,Kt[L])}we=Ke,Ht=ct,He=B,Ze=Ie}Gn("setSize"),ve=!1}cn>0&&bn>0&&(f.clearRect(0,0,u.width,u.height),Gn("drawClear"),M.forEach(b=>b()),Gn("draw")),Kt.show&&se&&(Wl(Kt),se=!1),ge&&te&&(Ar(null,!0,!1),te=!1),he.show&&he.live&&pe&&(ld(),pe=!1),l||(l=!0,i.status=1,Gn("ready")),Ks=!1,hn=!1}i.redraw=(b,E)=>{ye=E||!1,b!==!1?er(C,D.min,D.max):Qn()};function rd(b,E){let L=S[b];if(L.from==null){if(un==0){let F=L.range(i,E.min,E.max,b);E.min=F[0],E.max=F[1]}if(E.min>E.max){let F=E.min;E.min=E.max,E.max=F}if(un>1&&E.min!=null&&E.max!=null&&E.max-E.min<1e-16)return;b==C&&L.distr==2&&un>0&&(E.min=cs(E.min,e[0]),E.max=cs(E.max,e[0]),E.min==E.max&&E.max++),W[b]=E,oe=!0,Qn()}}i.setScale=rd;let od,ad,ro,oo,gm,_m,ao,lo,vm,xm,Jt,rn,Qs=!1,Yn=de.drag,zn=Yn.x,Vn=Yn.y;ge&&(de.x&&(od=Hi(yE,g)),de.y&&(ad=Hi(bE,g)),D.ori==0?(ro=od,oo=ad):(ro=ad,oo=od),Jt=de.left,rn=de.top);let Kt=i.select=Pn({show:!0,over:!0,left:0,width:0,top:0,height:0},n.select),co=Kt.show?Hi(xE,Kt.over?g:p):null;function Wl(b,E){if(Kt.show){for(let L in b)Kt[L]=b[L],L in ud&&nn(co,L,b[L]);E!==!1&&Gn("setSelect")}}i.setSelect=Wl;function Jx(b){if(x[b].show)ee&&Dp(lt[b],Kr);else if(ee&&Di(lt[b],Kr),ge){let L=Pe?dt[0]:dt[b];L!=null&&Cs(L,-10,-10,B,Ie)}}function er(b,E,L){rd(b,{min:E,max:L})}function ms(b,E,L,F){E.focus!=null&&ty(b),E.show!=null&&x.forEach((X,K)=>{K>0&&(b==K||b==null)&&(X.show=E.show,Jx(K),s==2?(er(X.facets[0].scale,null,null),er(X.facets[1].scale,null,null)):er(X.scale,null,null),Qn())}),L!==!1&&Gn("setSeries",b,E),F&&Ma("setSeries",i,b,E)}i.setSeries=ms;function Kx(b,E){Pn(R[b],E)}function jx(b,E){b.fill=wt(b.fill||null),b.dir=Rt(b.dir,-1),E=E??R.length,R.splice(E,0,b)}function Qx(b){b==null?R.length=0:R.splice(b,1)}i.addBand=jx,i.setBand=Kx,i.delBand=Qx;function ey(b,E){x[b].alpha=E,ge&&dt[b]!=null&&(dt[b].style.opacity=E),ee&&lt[b]&&(lt[b].style.opacity=E)}let Ns,tr,Er,uo={focus:!0};function ty(b){if(b!=Er){let E=b==null,L=ze.alpha!=1;x.forEach((F,X)=>{if(s==1||X>0){let K=E||X==0||X==b;F._focus=E?null:K,L&&ey(X,K?1:ze.alpha)}}),Er=b,L&&Qn()}}ee&&tt&&Tt(Z0,Re,b=>{de._lock||(et(b),Er!=null&&ms(null,uo,!0,Tn.setSeries))});function gs(b,E,L){let F=S[E];L&&(b=b/Lt-(F.ori==1?ct:Ke));let X=B;F.ori==1&&(X=Ie,b=X-b),F.dir==-1&&(b=X-b);let K=F._min,ae=F._max,fe=b/X,be=K+(ae-K)*fe,Oe=F.distr;return Oe==3?aa(10,be):Oe==4?kE(be,F.asinh):Oe==100?F.bwd(be):be}function ny(b,E){let L=gs(b,C,E);return cs(L,e[0],gn,_n)}i.valToIdx=b=>cs(b,e[0]),i.posToIdx=ny,i.posToVal=gs,i.valToPos=(b,E,L)=>S[E].ori==0?r(b,S[E],L?q:B,L?I:0):o(b,S[E],L?ue:Ie,L?w:0),i.setCursor=(b,E,L)=>{Jt=b.left,rn=b.top,Ar(null,E,L)};function ym(b,E){nn(co,sa,Kt.left=b),nn(co,Ul,Kt.width=E)}function bm(b,E){nn(co,"top",Kt.top=b),nn(co,Ol,Kt.height=E)}let ya=D.ori==0?ym:bm,ba=D.ori==1?ym:bm;function iy(){if(ee&&he.live)for(let b=s==2?1:0;b<x.length;b++){if(b==0&&ft)continue;let E=he.values[b],L=0;for(let F in E)We[b][L++].firstChild.nodeValue=E[F]}}function ld(b,E){if(b!=null&&(b.idxs?b.idxs.forEach((L,F)=>{ie[F]=L}):GE(b.idx)||ie.fill(b.idx),he.idx=ie[0]),ee&&he.live){for(let L=0;L<x.length;L++)(L>0||s==1&&!ft)&&sy(L,ie[L]);iy()}pe=!1,E!==!1&&Gn("setLegend")}i.setLegend=ld;function sy(b,E){let L=x[b],F=b==0&&z==2?Si:e[b],X;ft?X=L.values(i,b,E)??rt:(X=L.value(i,E==null?null:F[E],b,E),X=X==null?rt:{_:X}),he.values[b]=X}function Ar(b,E,L){vm=Jt,xm=rn,[Jt,rn]=de.move(i,Jt,rn),de.left=Jt,de.top=rn,ge&&(ro&&Cs(ro,Fn(Jt),0,B,Ie),oo&&Cs(oo,0,Fn(rn),B,Ie));let F,X=gn>_n;Ns=Xt,tr=null;let K=D.ori==0?B:Ie,ae=D.ori==1?B:Ie;if(Jt<0||un==0||X){F=de.idx=null;for(let fe=0;fe<x.length;fe++){let be=dt[fe];be!=null&&Cs(be,-10,-10,B,Ie)}tt&&ms(null,uo,!0,b==null&&Tn.setSeries),he.live&&(ie.fill(F),pe=!0)}else{let fe,be,Oe;s==1&&(fe=D.ori==0?Jt:rn,be=gs(fe,C),F=de.idx=cs(be,e[0],gn,_n),Oe=G(e[0][F],D,K,0));let Fe=-10,Be=-10,ot=0,Pt=0,At=!0,yt="",je="";for(let $e=s==2?1:0;$e<x.length;$e++){let jt=x[$e],dn=ie[$e],Hn=dn==null?null:s==1?e[$e][dn]:e[$e][1][dn],Gt=de.dataIdx(i,$e,F,be),fn=Gt==null?null:s==1?e[$e][Gt]:e[$e][1][Gt];if(pe=pe||fn!=Hn||Gt!=dn,ie[$e]=Gt,$e>0&&jt.show){let Mi=Gt==null?-10:Gt==F?Oe:G(s==1?e[0][Gt]:e[$e][0][Gt],D,K,0),ri=fn==null?-10:U(fn,s==1?S[jt.scale]:S[jt.facets[1].scale],ae,0);if(tt&&fn!=null){let Oi=D.ori==1?Jt:rn,Yi=kn(ze.dist(i,$e,Gt,ri,Oi));if(Yi<Ns){let _s=ze.bias;if(_s!=0){let wi=gs(Oi,jt.scale),Fi=fn>=0?1:-1,$i=wi>=0?1:-1;$i==Fi&&($i==1?_s==1?fn>=wi:fn<=wi:_s==1?fn<=wi:fn>=wi)&&(Ns=Yi,tr=$e)}else Ns=Yi,tr=$e}}if(pe||Pe){let Oi,Yi;D.ori==0?(Oi=Mi,Yi=ri):(Oi=ri,Yi=Mi);let _s,wi,Fi,$i,vs,oi,Ti=!0,Cr=ce.bbox;if(Cr!=null){Ti=!1;let ai=Cr(i,$e);Fi=ai.left,$i=ai.top,_s=ai.width,wi=ai.height}else Fi=Oi,$i=Yi,_s=wi=ce.size(i,$e);if(oi=ce.fill(i,$e),vs=ce.stroke(i,$e),Pe)$e==tr&&Ns<=ze.prox&&(Fe=Fi,Be=$i,ot=_s,Pt=wi,At=Ti,yt=oi,je=vs);else{let ai=dt[$e];ai!=null&&(Zt[$e]=Fi,ii[$e]=$i,nv(ai,_s,wi,Ti),ev(ai,oi,vs),Cs(ai,Wi(Fi),Wi($i),B,Ie))}}}}if(Pe){let $e=ze.prox,jt=Er==null?Ns<=$e:Ns>$e||tr!=Er;if(pe||jt){let dn=dt[0];dn!=null&&(Zt[0]=Fe,ii[0]=Be,nv(dn,ot,Pt,At),ev(dn,yt,je),Cs(dn,Wi(Fe),Wi(Be),B,Ie))}}}if(Kt.show&&Qs)if(b!=null){let[fe,be]=Tn.scales,[Oe,Fe]=Tn.match,[Be,ot]=b.cursor.sync.scales,Pt=b.cursor.drag;if(zn=Pt._x,Vn=Pt._y,zn||Vn){let{left:At,top:yt,width:je,height:$e}=b.select,jt=b.scales[Be].ori,dn=b.posToVal,Hn,Gt,fn,Mi,ri,Oi=fe!=null&&Oe(fe,Be),Yi=be!=null&&Fe(be,ot);Oi&&zn?(jt==0?(Hn=At,Gt=je):(Hn=yt,Gt=$e),fn=S[fe],Mi=G(dn(Hn,Be),fn,K,0),ri=G(dn(Hn+Gt,Be),fn,K,0),ya(us(Mi,ri),kn(ri-Mi))):ya(0,K),Yi&&Vn?(jt==1?(Hn=At,Gt=je):(Hn=yt,Gt=$e),fn=S[be],Mi=U(dn(Hn,ot),fn,ae,0),ri=U(dn(Hn+Gt,ot),fn,ae,0),ba(us(Mi,ri),kn(ri-Mi))):ba(0,ae)}else hd()}else{let fe=kn(vm-gm),be=kn(xm-_m);if(D.ori==1){let ot=fe;fe=be,be=ot}zn=Yn.x&&fe>=Yn.dist,Vn=Yn.y&&be>=Yn.dist;let Oe=Yn.uni;Oe!=null?zn&&Vn&&(zn=fe>=Oe,Vn=be>=Oe,!zn&&!Vn&&(be>fe?Vn=!0:zn=!0)):Yn.x&&Yn.y&&(zn||Vn)&&(zn=Vn=!0);let Fe,Be;zn&&(D.ori==0?(Fe=ao,Be=Jt):(Fe=lo,Be=rn),ya(us(Fe,Be),kn(Be-Fe)),Vn||ba(0,ae)),Vn&&(D.ori==1?(Fe=ao,Be=Jt):(Fe=lo,Be=rn),ba(us(Fe,Be),kn(Be-Fe)),zn||ya(0,K)),!zn&&!Vn&&(ya(0,0),ba(0,0))}if(Yn._x=zn,Yn._y=Vn,b==null){if(L){if(Lm!=null){let[fe,be]=Tn.scales;Tn.values[0]=fe!=null?gs(D.ori==0?Jt:rn,fe):null,Tn.values[1]=be!=null?gs(D.ori==1?Jt:rn,be):null}Ma(Tp,i,Jt,rn,B,Ie,F)}if(tt){let fe=L&&Tn.setSeries,be=ze.prox;Er==null?Ns<=be&&ms(tr,uo,!0,fe):Ns>be?ms(null,uo,!0,fe):tr!=Er&&ms(tr,uo,!0,fe)}}pe&&(he.idx=F,ld()),E!==!1&&Gn("setCursor")}let nr=null;Object.defineProperty(i,"rect",{get(){return nr==null&&Sa(!1),nr}});function Sa(b=!1){b?nr=null:(nr=g.getBoundingClientRect(),Gn("syncRect",nr))}function Sm(b,E,L,F,X,K,ae){de._lock||Qs&&b!=null&&b.movementX==0&&b.movementY==0||(cd(b,E,L,F,X,K,ae,!1,b!=null),b!=null?Ar(null,!0,!0):Ar(E,!0,!1))}function cd(b,E,L,F,X,K,ae,fe,be){if(nr==null&&Sa(!1),et(b),b!=null)L=b.clientX-nr.left,F=b.clientY-nr.top;else{if(L<0||F<0){Jt=-10,rn=-10;return}let[Oe,Fe]=Tn.scales,Be=E.cursor.sync,[ot,Pt]=Be.values,[At,yt]=Be.scales,[je,$e]=Tn.match,jt=E.axes[0].side%2==1,dn=D.ori==0?B:Ie,Hn=D.ori==1?B:Ie,Gt=jt?K:X,fn=jt?X:K,Mi=jt?F:L,ri=jt?L:F;if(At!=null?L=je(Oe,At)?a(ot,S[Oe],dn,0):-10:L=dn*(Mi/Gt),yt!=null?F=$e(Fe,yt)?a(Pt,S[Fe],Hn,0):-10:F=Hn*(ri/fn),D.ori==1){let Oi=L;L=F,F=Oi}}be&&(E==null||E.cursor.event.type==Tp)&&((L<=1||L>=B-1)&&(L=Zr(L,B)),(F<=1||F>=Ie-1)&&(F=Zr(F,Ie))),fe?(gm=L,_m=F,[ao,lo]=de.move(i,L,F)):(Jt=L,rn=F)}let ud={width:0,height:0,left:0,top:0};function hd(){Wl(ud,!1)}let Mm,wm,Tm,Em;function Am(b,E,L,F,X,K,ae){Qs=!0,zn=Vn=Yn._x=Yn._y=!1,cd(b,E,L,F,X,K,ae,!0,!1),b!=null&&(Tt(Ep,Ip,Cm,!1),Ma(Y0,i,ao,lo,B,Ie,null));let{left:fe,top:be,width:Oe,height:Fe}=Kt;Mm=fe,wm=be,Tm=Oe,Em=Fe}function Cm(b,E,L,F,X,K,ae){Qs=Yn._x=Yn._y=!1,cd(b,E,L,F,X,K,ae,!1,!0);let{left:fe,top:be,width:Oe,height:Fe}=Kt,Be=Oe>0||Fe>0,ot=Mm!=fe||wm!=be||Tm!=Oe||Em!=Fe;if(Be&&ot&&Wl(Kt),Yn.setScale&&Be&&ot){let Pt=fe,At=Oe,yt=be,je=Fe;if(D.ori==1&&(Pt=be,At=Fe,yt=fe,je=Oe),zn&&er(C,gs(Pt,C),gs(Pt+At,C)),Vn)for(let $e in S){let jt=S[$e];$e!=C&&jt.from==null&&jt.min!=Xt&&er($e,gs(yt+je,$e),gs(yt,$e))}hd()}else de.lock&&(de._lock=!de._lock,Ar(E,!0,b!=null));b!=null&&(In(Ep,Ip),Ma(Ep,i,Jt,rn,B,Ie,null))}function ry(b,E,L,F,X,K,ae){if(de._lock)return;et(b);let fe=Qs;if(Qs){let be=!0,Oe=!0,Fe=10,Be,ot;D.ori==0?(Be=zn,ot=Vn):(Be=Vn,ot=zn),Be&&ot&&(be=Jt<=Fe||Jt>=B-Fe,Oe=rn<=Fe||rn>=Ie-Fe),Be&&be&&(Jt=Jt<ao?0:B),ot&&Oe&&(rn=rn<lo?0:Ie),Ar(null,!0,!0),Qs=!1}Jt=-10,rn=-10,ie.fill(null),Ar(null,!0,!0),fe&&(Qs=fe)}function Rm(b,E,L,F,X,K,ae){de._lock||(et(b),xa(),hd(),b!=null&&Ma(J0,i,Jt,rn,B,Ie,null))}function Pm(){T.forEach(sC),k(i.width,i.height,!0)}jr(Nh,oa,Pm);let ho={};ho.mousedown=Am,ho.mousemove=Sm,ho.mouseup=Cm,ho.dblclick=Rm,ho.setSeries=(b,E,L,F)=>{let X=Tn.match[2];L=X(i,E,L),L!=-1&&ms(L,F,!0,!1)},ge&&(Tt(Y0,g,Am),Tt(Tp,g,Sm),Tt($0,g,b=>{et(b),Sa(!1)}),Tt(Z0,g,ry),Tt(J0,g,Rm),Bp.add(i),i.syncRect=Sa);let Xl=i.hooks=n.hooks||{};function Gn(b,E,L){si?kt.push([b,E,L]):b in Xl&&Xl[b].forEach(F=>{F.call(null,i,E,L)})}(n.plugins||[]).forEach(b=>{for(let E in b.hooks)Xl[E]=(Xl[E]||[]).concat(b.hooks[E])});let Im=(b,E,L)=>L,Tn=Pn({key:null,setSeries:!1,filters:{pub:av,sub:av},scales:[C,x[1]?x[1].scale:null],match:[lv,lv,Im],values:[null,null]},de.sync);Tn.match.length==2&&Tn.match.push(Im),de.sync=Tn;let Lm=Tn.key,dd=sx(Lm);function Ma(b,E,L,F,X,K,ae){Tn.filters.pub(b,E,L,F,X,K,ae)&&dd.pub(b,E,L,F,X,K,ae)}dd.sub(i);function oy(b,E,L,F,X,K,ae){Tn.filters.sub(b,E,L,F,X,K,ae)&&ho[b](null,E,L,F,X,K,ae)}i.pub=oy;function ay(){dd.unsub(i),Bp.delete(i),Bn.clear(),Np(Nh,oa,Pm),c.remove(),Re?.remove(),Gn("destroy")}i.destroy=ay;function fd(){Gn("init",n,e),va(e||n.data,!1),W[C]?rd(C,W[C]):xa(),se=Kt.show&&(Kt.width>0||Kt.height>0),te=pe=!0,k(n.width,n.height)}return x.forEach(to),T.forEach(Ps),t?t instanceof HTMLElement?(t.appendChild(c),fd()):t(i,fd):fd(),i}xn.assign=Pn;xn.fmtNum=qp;xn.rangeNum=Uh;xn.rangeLog=kh;xn.rangeAsinh=Wp;xn.orient=eo;xn.pxRatio=Lt;xn.join=ZE;xn.fmtDate=$p,xn.tzDate=oA;xn.sync=sx;{xn.addGap=GA,xn.clipGaps=Vh;let n=xn.paths={points:ux};n.linear=dx,n.stepped=XA,n.bars=qA,n.spline=$A}var Yh=30,rC=30,oC=100,aC=3,lC=Yh*rC,Xh=["#2f6fb0","#d1581a","#3b8f5a","#7a3fa0","#1f8a8a","#b03a5b","#8a6d1f","#7a8797"],gx=n=>getComputedStyle(document.documentElement).getPropertyValue(n).trim(),$h=()=>({stroke:()=>gx("--muted"),grid:{width:1,stroke:()=>gx("--line")},ticks:{show:!1},font:"11px system-ui"}),qh=class{#e;#t;#i;#n=0;constructor(e,t,i){this.#t=[[],...t.map(()=>[])];let s=$h();this.#e=new xn({width:e.clientWidth||300,height:e.clientHeight||140,cursor:{y:!1},legend:{show:!1},scales:{x:{time:!1},y:{range:(r,o,a)=>[Math.min(o??0,0),Math.max(1.05*(a??0),i)]}},axes:[{...s,size:26,values:(r,o)=>o.map(a=>`${a} s`)},{...s,size:46}],series:[{},...t.map(({name:r},o)=>({label:r,stroke:Xh[o%Xh.length],width:1.4,spanGaps:!1}))]},this.#t,e),this.#i=new ResizeObserver(()=>{e.clientWidth&&this.#e.setSize({width:e.clientWidth,height:e.clientHeight})}),this.#i.observe(e)}add(e,t){let i=this.#t[0];i.length&&e<i[i.length-1]&&this.#t.forEach(s=>s.splice(0)),i.push(e),t.forEach((s,r)=>this.#t[r+1]?.push(s)),i.length>lC&&this.#t.forEach(s=>s.shift())}draw(){let e=this.#t[0],t=performance.now();if(!e.length||t<this.#n)return;this.#n=1/0,requestAnimationFrame(()=>setTimeout(()=>{let s=performance.now()-t;this.#n=t+Math.max(oC,aC*s)}));let i=e[e.length-1];this.#e.setData(this.#t,!1),this.#e.setScale("x",{min:i-Yh,max:i})}close(){this.#i.disconnect(),this.#e.destroy()}},Js=n=>Xh[n%Xh.length];var cC=Math.PI/180;function Zh(){let{description:n,status:e,target:t,path:i}=ut(),[s,r]=Ce(!1),[o,a]=Ce(null),l=async()=>{if(o)return a(null);a("computing"),await me.attempt(async()=>a(await Ct("GET","/workspace"))),a(T=>T==="computing"?null:T)};at(()=>u.current?.workspace(o==="computing"?null:o),[o,n]);let c=$t(null),u=$t(null);at(()=>(u.current=Rh(c.current),()=>u.current?.close()),[]),at(()=>{n&&u.current?.describe(n),me.recent.slice(-1).forEach(T=>u.current?.show(T))},[n]),po(T=>u.current?.show(T),[]);let f=e&&Zn(e),d=f?.target_m&&(f.done??1)<1,p=n?.platform,g=p&&t?ac(p,t):null;at(()=>{g?u.current?.aim(g.position_m,g.rotation_rad):t||u.current?.aim(d?f.target_m:null,f?.target_rotation_rad??null)},[String(t),d,String(f?.target_m)]);let v=Lr()==="";at(()=>{p&&t?u.current?.drag(s?"turn":"move",(T,S)=>me.change({target:[...T.map(R=>mo(1e3*R,0)),...S.map(R=>mo(R/cC,1))]})):u.current?.drag(null)},[t===null,s,n]);let m=f?.path,_=i&&!i.planning&&(!m||m.plan===i.plan||e?.program!=="path")?i:null;at(()=>u.current?.route(_?.route_m??null,_?.obstacle?.position_m??null),[_,n]);let x=_&&m?.plan===_.plan?m.along_m/Math.max(m.length_m,1e-9):0;return at(()=>u.current?.done(x),[x,_]),h("section",{class:"card robot","aria-label":"The robot in three dimensions",children:[h("div",{class:"scene",ref:c}),h(hC,{}),p&&li()&&h("div",{class:"overlay",children:[h("button",{"aria-pressed":o!==null,disabled:o==="computing",onClick:()=>{l()},title:"Show where the cables can hold the platform at rest",children:o==="computing"?"Computing \u2026":"Workspace"}),!t&&v&&h("button",{onClick:()=>cc(p),title:"Drag the arrows of the outline to where the platform is to go",children:"Drag a target"}),t&&Ia(p).length>0&&h("button",{"aria-pressed":s,onClick:()=>r(!s),children:"Turn"}),t&&h("button",{class:"go",disabled:!g,onClick:()=>kd(p),children:"Go there"}),t&&h("button",{onClick:()=>me.change({target:null}),children:"Discard the target"})]})]})}var uC=n=>n==null?"\u2013":mo(1e3*n,1);function hC(){let{description:n}=ut(),e=$t(null),t=n?.platform?ki(n.platform):[];return po(i=>{if(!e.current)return;let s=i.pose[0]!=null;e.current.textContent=s?t.map((r,o)=>`${r} ${uC(i.pose[o])}`).join("   ")+" mm":"position unknown until the cables are tight"},[t.join()]),n?.platform?h("output",{class:"place",ref:e}):null}function _x(){let{description:n}=ut();return n?h("section",{class:"card","aria-labelledby":"tensions",children:[h("h2",{id:"tensions",children:["Cable tensions ",h(dC,{})]}),h("ul",{class:"tensions",children:n.axes.map((e,t)=>h(fC,{number:t,name:e.name,limits:n.limits},e.name))})]}):null}function dC(){let[n,e]=Ce("");return po(({tension_measured:t})=>e(t.every(Boolean)?"measured":t.some(Boolean)?"~ estimated":"estimated from the motors"),[]),h("span",{class:"origin",children:n})}function fC({number:n,name:e,limits:t}){let i=$t(null),s=$t(null),r=$t(null),o=t.tension_min_N[n]??null,a=t.tension_max_N[n]??null,l=1.15*(a??100),c=u=>({left:`${100*u/l}%`});return po(u=>{if(!i.current||!s.current||!r.current)return;let f=u.tension_N[n]??null,d=Math.min(Math.max(f??0,0)/l,1);i.current.style.transform=`scaleX(${d})`,i.current.style.background=`#${Mp(f,o,a).getHexString()}`;let p=u.tension_measured[n];s.current.textContent=f===null?"unknown":`${p?"":"~"}${f.toFixed(0)} N`,s.current.title=p?"measured by a sensor":"estimated from the motor's torque",r.current.setAttribute("aria-valuenow",(f??0).toFixed(0))},[n,l]),h("li",{children:[h("span",{class:"name",children:[h("i",{style:{background:Js(n)}}),e]}),h("div",{class:"meter",role:"meter","aria-label":`Tension of ${e} in N`,"aria-valuemin":0,"aria-valuemax":Math.round(l),"aria-valuenow":0,ref:r,children:[h("div",{class:"bar",ref:i}),o!==null&&h("i",{class:"limit",style:c(o),title:`lowest allowed: ${o} N`}),a!==null&&h("i",{class:"limit",style:c(a),title:`highest allowed: ${a} N`})]}),h("span",{class:"value",ref:s})]})}var pC=({pose:n,pose_setpoint:e})=>n[0]==null||e[0]==null?null:1e3*Math.hypot(...[0,1,2].map(t=>(n[t]??0)-(e[t]??0))),mC=()=>me.status?.real_time_factor??null;function vx(){let{description:n}=ut();return n?h("section",{class:"card trends","aria-label":`The last ${Yh} s`,children:[n.platform&&h(tm,{title:"Distance from the set-point, mm",curves:[{name:"distance",unit:"mm"}],values:e=>[pC(e)],floor:1}),h(tm,{title:"Tensions, N",curves:n.axes.map(e=>({name:e.name,unit:"N"})),values:e=>e.tension_N,floor:Math.max(...n.limits.tension_max_N.map(e=>e??10))}),n.simulated&&h(tm,{title:"Simulated against real time",curves:[{name:"factor",unit:""}],values:()=>[mC()],floor:1.2})]}):null}function tm({title:n,curves:e,values:t,floor:i}){let s=$t(null),r=$t(null);return at(()=>(r.current=new qh(s.current,e,i),me.recent.forEach(o=>r.current.add(o.time_s,t(o))),r.current.draw(),()=>r.current?.close()),[e.map(o=>o.name).join()]),po(o=>{r.current?.add(o.time_s,t(o)),r.current?.draw()},[]),h("figure",{children:[h("figcaption",{children:n}),h("div",{class:"trend",ref:s})]})}var gC={starting:"the control loop starts",unconfigured:"drives not booted",inactive:"drives booted, not checked",ready:"drives ready, no power",active:"power on",fault:"fault: the power is off",dead:"the control loop has ended"};function nm({event:{kind:n,time:e,text:t,times:i},exact:s=!1}){return h("li",{class:n==="reason"?"reason":"",children:[h("time",{children:s?e.slice(0,23).replace("T"," "):e.slice(11,19)})," ",n==="state"?gC[t]??t:t.replace(/^pose by/,"move by"),i>1?` (${i} times)`:""]})}function xx(){let{events:n}=ut();return h("section",{class:"card","aria-labelledby":"events",children:[h("h2",{id:"events",children:"Events"}),n.length===0&&h("p",{class:"quiet",children:"Nothing has happened since this page was opened."}),h("ol",{class:"events",tabIndex:0,"aria-labelledby":"events",children:n.map(e=>h(nm,{event:e},e.number))})]})}function yx(){let{status:n}=ut();if(!n?.axes.length||!n.axes[0]?.name)return null;let e=(t,i,s=1)=>typeof t=="number"?(s*t).toFixed(i):"\u2013";return h("section",{class:"card","aria-labelledby":"drives",children:[h("h2",{id:"drives",children:"Drives"}),h("div",{class:"scroll",tabIndex:0,children:h("table",{children:[h("thead",{children:h("tr",{children:[h("th",{children:"axis"}),h("th",{children:"node"}),h("th",{children:"answers"}),h("th",{children:"angle, deg"}),h("th",{children:"torque, Nm"}),h("th",{children:"cable, m"})]})}),h("tbody",{children:n.axes.map(t=>h("tr",{children:[h("td",{children:String(t.name)}),h("td",{children:String(t.node_id)}),h("td",{children:t.alive===!1?"silent":t.valid===!1?"not valid":"yes"}),h("td",{children:e(t.position_rad,1,180/Math.PI)}),h("td",{children:e(t.torque_actual_Nm,3)}),h("td",{children:e(t.cable_length_m,4)})]},String(t.name)))})]})})]})}function bx(){let{status:n}=ut(),e=n?.parts.recording,t=e?e.recording?h(xt,{children:[e.file?.split("/").pop(),", ",((e.bytes??0)/1e6).toFixed(1)," MB. ",h("a",{href:Zi("recordings"),children:"Plot or download"})]}):h(xt,{children:["Not recording: ",e.error||"ended"]}):h(xt,{children:["Nothing is recorded: the daemon was started with ",h("code",{children:"--no-record"}),"."]});return h("section",{class:"card","aria-labelledby":"recording",children:[h("h2",{id:"recording",children:"Recording"}),h("p",{class:"quiet",children:me.connected?t:"\u2013"})]})}var Mx=500,Jh=null,Sx=()=>{};function Kh(){let{connected:n}=ut(),[e,t]=Ce(Jh),i=s=>{let r=s.client===Wn(),o=Jh?.running&&!s.running&&r;me.procedure=s.running&&r,t(Jh=s);let{status:a}=me;o&&(a?.state!=="active"||a.program==="hold")&&me.right.release()};return at(()=>{if(!n)return;let s=!0;Sx();let r=Ir(async()=>{try{let o=await Ct("GET","/procedure");JSON.stringify(o)!==JSON.stringify(Jh)&&i(o)}catch{}!s&&!me.procedure&&r()},Mx);return Sx=r,()=>{s=!1,me.procedure||r()}},[n]),{job:e,start:s=>me.attempt(async()=>i(await me.right.procedure(s)))}}var _C=()=>{me.attempt(()=>Ct("DELETE","/procedure"))};function jh({job:n,curves:e=!1}){let t=n.steps.length-1;return h("section",{class:"card","aria-labelledby":"progress",children:[h("div",{class:"head",children:[h("h2",{id:"progress",children:n.running?"Running":"Last run"}),n.running&&h("button",{onClick:_C,children:n.ending?"Remove the power now":"Cancel"})]}),h("p",{class:"begun",children:[h("strong",{children:Xi(n.what)})," ",h("span",{class:"quiet",children:["by ",n.client===Wn()?"this page":n.client]})]}),n.running&&h("p",{class:"quiet",children:n.ending?`It ends: ${n.ending}.`:"Keep this page open: the procedure ends if the page is closed or does not respond."}),n.running&&!n.steps.length&&h("p",{children:Xi(n.lines.at(-1)??"starting \u2026")}),!n.running&&h(vC,{job:n}),n.steps.length>0&&h("ol",{class:"steps",children:n.steps.map(({what:i,share:s},r)=>{let o=r<t||!n.running;return h("li",{class:o?"done":"now",children:[h("span",{children:Xi(i.replace(/ \(.*% of all\)$/,""))}),!o&&s!=null?h("progress",{max:1,value:s,"aria-label":i}):h("small",{children:o?n.error&&r===t?"ended":"done":"working"})]},r)})}),e&&n.running&&h(yC,{}),n.lines.length>0&&h("details",{children:[h("summary",{children:"Messages"}),h("pre",{tabIndex:0,children:n.lines.join(`
`)})]})]})}function vC({job:n}){let e=n.reports.filter(({path:t})=>t.endsWith(".html"));return h(xt,{children:[h("p",{class:n.error?"fault":"on",children:n.error?Xi(n.error):"The procedure is finished."}),e.length>0&&h("p",{class:"links",children:e.map(({title:t,path:i})=>h("a",{href:i,target:"_blank",rel:"noopener",children:["Open the report: ",t]},i))})]})}var Xi=n=>{let e=n.charAt(0).toUpperCase()+n.slice(1);return/[.!?]$/.test(e)||e.length<40?e:`${e}.`},xC=[{key:"error_deg",title:"Position error, deg"},{key:"torque_Nm",title:"Torque, Nm"}];function yC(){let[n,e]=Ce(null);return at(()=>Ir(()=>Ct("GET","/procedure/curves").then(t=>t.time_s.length&&e(t),()=>{}),2*Mx),[]),n?.time_s.length?h("div",{class:"trends",children:xC.map(({key:t,title:i},s)=>h(bC,{title:i,time_s:n.time_s,values:n[t],colour:Js(s)},t))}):null}function bC({title:n,time_s:e,values:t,colour:i}){let s=$t(null),r=$t(null);return at(()=>{let o=s.current,a=[{...$h(),size:26,values:(c,u)=>u.map(f=>`${f} s`)},{...$h(),size:50}];r.current=new xn({width:o.clientWidth||300,height:150,cursor:{show:!1},legend:{show:!1},scales:{x:{time:!1}},axes:a,series:[{},{stroke:i,width:1.2}]},[[],[]],o);let l=new ResizeObserver(()=>r.current?.setSize({width:o.clientWidth,height:150}));return l.observe(o),()=>{l.disconnect(),r.current?.destroy()}},[]),at(()=>r.current?.setData([e,t]),[e]),h("figure",{children:[h("figcaption",{children:n}),h("div",{class:"trend",ref:s})]})}var im={geometry:"Geometry",tension:"Winch tension",lens:"Camera lens"},SC={geometry:"Exit points, anchor points and drums never have exactly the measures of the robot's file. Calibration finds their errors from the cable lengths at many poses, so that the platform goes where it is sent.",tension:"A motor's torque shows the tension of its cable only as well as radius and friction of the winch are known. Known masses measure both.",lens:"A camera on the platform sees markers on the floor or the walls and so measures poses, which cable lengths alone cannot. Its lens must be known first."},wx={geometry:["measure","adopt","check","undo"],tension:["tension"],lens:["lens"]};function Ax(){let{description:n,status:e}=ut(),{job:t,start:i}=Kh(),[s,r]=Ce(null);if(!n||!e)return null;let o=Object.keys(im).find(u=>wx[u].includes(t?.procedure??"")),a=s??o??(n.platform?"geometry":"tension"),l=t&&wx[a].includes(t.procedure)?t:null,c={geometry:TC,tension:EC,lens:AC}[a];return h(xt,{children:[h("div",{class:"parts",role:"group","aria-label":"What to calibrate",children:Object.keys(im).map(u=>h("button",{"aria-pressed":u===a,onClick:()=>r(u),children:im[u]},u))}),h("div",{class:"columns",children:[h("div",{class:"column wide",children:h(c,{job:t,start:i})}),h("div",{class:"column",children:[t?.running&&!l&&h("section",{class:"card",children:h("p",{children:Xi(`${t.client} runs another procedure: ${t.what}`)})}),l&&h(jh,{job:l}),l?.running&&l.procedure!=="undo"&&a==="geometry"&&h(Zh,{}),l&&!l.running&&l.result&&h(CC,{job:l,start:i}),!l&&h("section",{class:"card",children:[h("h2",{children:"What it is for"}),h("p",{children:SC[a]})]})]})]})]})}function rm({title:n,children:e}){return h("section",{class:"card","aria-label":n,children:[h("h2",{children:n}),h("ol",{class:"guide",children:e})]})}var sm=({is:n,children:e})=>h("li",{class:n?"on":"busy",children:[n?"\u2713 ":"\u25CB ",h("span",{children:e})]}),MC=9.81,wC=.05,Tx=2,Ex=200;function TC({job:n,start:e}){let{description:t,status:i}=ut(),[s,r]=Ce(""),[o,a]=Ce(!1),l=t.platform;if(!l)return h("section",{class:"card",children:h("p",{children:"This robot has no platform: there is no geometry to calibrate."})});let{tight:c,position_m:u=[]}=Zn(i),f=u.every((T,S)=>Math.abs(T-(l.home_m[S]??0))<wC),d=i.state==="active"&&c!==!1&&f,p=i.calibration,g=t.axes.length>l.controlled.length,v=!!n?.offers.simulated_camera,m=n?.running??!1,_=s.trim()?Number(s):null,x=_===null||Number.isInteger(_)&&_>=Tx&&_<=Ex;return h(xt,{children:h(rm,{title:"Calibrate the geometry",children:[h("li",{children:[h("h3",{children:"Before"}),h("ul",{class:"conditions",children:[h(sm,{is:d,children:["The platform is at home on tight cables. ",h("em",{children:"Lower"})," and ",h("em",{children:"Tighten"})," bring it there."]}),h(sm,{is:!p,children:["The robot runs with the geometry of its file.",p&&` Now calibration ${p.version??""} is in force: undo it, and start the robot again.`]}),!g&&h(sm,{is:o,children:"With one cable for each direction, lengths alone show nothing. A camera or measured points are needed."})]}),p&&h("button",{disabled:m,onClick:()=>{e({procedure:"undo"})},children:"Undo the calibration in force"})]}),h("li",{children:[h("h3",{children:"Measure"}),h("p",{children:"The platform moves through poses in its box of targets. The robot reads its cables at each. Nothing is adopted yet."}),h("div",{class:"row",children:[h("label",{children:["Poses ",h("input",{class:"number",inputMode:"numeric",placeholder:"auto",value:s,"aria-invalid":!x,onInput:T=>r(T.currentTarget.value)})]}),h("span",{class:x?"quiet":"fault",children:x?"empty: as many as improve the result, up to 100":`Allowed: ${Tx} to ${Ex}`}),v&&h("label",{class:"consent",children:[h("input",{type:"checkbox",checked:o,onChange:T=>a(T.currentTarget.checked)})," ",h("span",{children:"with the camera on the platform"})]})]}),h("div",{class:"row",children:h("button",{class:"go",disabled:!d||m||!x||!!p,onClick:()=>{e({procedure:"measure",poses:_,camera:o})},children:"Measure"})})]}),h("li",{children:[h("h3",{children:"Judge and adopt"}),h("p",{children:"The result compares predictions with poses that were not used for the fit. Adopt it there if it is good. It takes effect at the next start."})]}),h("li",{children:[h("h3",{children:"Check later"}),h("p",{children:"Ten poses show whether a cable, a drum or an exit point has changed since."}),h("button",{disabled:!d||m,onClick:()=>{e({procedure:"check"})},children:"Check the robot"})]})]})})}function EC({job:n,start:e}){let{description:t}=ut(),i=t.axes.map(({name:p})=>p),[s,r]=Ce(i[0]??""),o=t.limits.tension_max_N[Math.max(0,i.indexOf(s))]??1/0,[a,l]=Ce(null),c=a??[.2,.5,1].map(p=>(p*Math.min(10,.9*o/MC)).toPrecision(2)).map(Number).join(", "),u=c.split(",").map(Number),f=u.length>=3&&u.every(p=>p>=.05&&p<=1e3),d=`cdpr tension calibrate WINCH --masses ${u.join(",")} --bus URL`;return h(rm,{title:"Calibrate a winch by tension",children:[h("li",{children:[h("h3",{children:"Winch and masses"}),h("div",{class:"row",children:[h("label",{children:["Winch ",h("select",{value:s,onChange:p=>r(p.currentTarget.value),children:i.map(p=>h("option",{children:p},p))})]}),h("label",{children:["Masses, kg ",h("input",{value:c,size:14,"aria-invalid":!f,onInput:p=>l(p.currentTarget.value)})]})]}),!f&&h("p",{class:"fault",children:"Allowed: at least three numbers, such as 2, 5, 10."})]}),h("li",{children:[h("h3",{children:"What will happen"}),h("p",{children:"The winch raises and lowers each mass at constant speed. Torque over tension gives the gain of the winch and its friction."})]}),h("li",{children:t.simulated?h(xt,{children:[h("p",{class:"quiet",children:"The robot is simulated: a separate simulated winch raises the masses."}),h("div",{class:"row",children:h("button",{class:"go",disabled:!f||n?.running,onClick:()=>{e({procedure:"tension",axis:s,masses_kg:u})},children:["Calibrate ",s]})})]}):h(xt,{children:[h("p",{children:"Somebody hangs each mass and confirms it at a terminal. End the daemon first, then enter:"}),h("pre",{tabIndex:0,children:d})]})})]})}function AC({job:n,start:e}){let[t,i]=Ce(30),{description:s}=ut();return h(rm,{title:"Calibrate the camera's lens",children:[h("li",{children:[h("h3",{children:"Board"}),h("p",{children:s.simulated?"The simulated camera looks at a ChArUco board of 9 by 6 squares of 28 mm, from random places.":"Print a board with `cdpr markers board`, glue it to a flat plate, and measure a square."})]}),s.simulated?h("li",{children:[h("h3",{children:"Images"}),h("div",{class:"row",children:[h("label",{children:["Number ",h("select",{value:t,onChange:r=>i(Number(r.currentTarget.value)),children:[12,20,30,50].map(r=>h("option",{children:r},r))})]}),h("button",{class:"go",disabled:n?.running,onClick:()=>{e({procedure:"lens",images:t})},children:"Calibrate the lens"})]})]}):h("li",{children:[h("h3",{children:"Images"}),h("p",{children:"Move the board through the whole image, tilted, near and far:"}),h("pre",{tabIndex:0,children:"cdpr camera calibrate opencv:0 --out lens.toml"})]}),h("li",{children:[h("h3",{children:"What to do next"}),h("p",{children:["The result names the views that are still missing. With the lens calibrated, ",h("em",{children:"Geometry"})," can use the camera."]})]})]})}function CC({job:n,start:e}){let t=n.result;switch(n.procedure){case"measure":return h(RC,{job:n,start:e});case"adopt":return h(pa,{title:"Adopted",good:!!t.in_force,text:t.in_force?"The calibration takes effect at the next start of the robot.":`Not adopted: ${String(t.not_taken_over??"")}`});case"check":return h(pa,{title:"Check",good:t.ok===!0,text:t.ok?"Nothing has changed enough to matter.":"The robot has changed. The messages name the part. Calibrate it again."});case"undo":return h(pa,{title:"Undone",good:!0,text:"The previous geometry applies from the next start of the robot."});case"tension":return h(PC,{job:n});case"lens":return h(IC,{job:n});default:return null}}function pa({title:n,good:e,text:t,children:i}){return h("section",{class:"card","aria-label":n,children:[h("h2",{children:n}),h("p",{class:e?"on":"busy",children:h("strong",{children:Xi(t)})}),i]})}var om=({of:n})=>h("dl",{class:"key-figures",children:n.map(([e,t])=>h("div",{children:[h("dt",{children:e}),h("dd",{children:t})]},e))}),Rs=(n,e,t,i=1)=>typeof n=="number"?`${(i*n).toFixed(e)} ${t}`:"\u2013";function RC({job:n,start:e}){let t=n.result,[i,s]=Ce(!1);if(!t.verification)return null;let{verification:r,change:o}=t,a=String(n.values.measurement),l=[...new Set(t.open.map(({advice:f})=>f))],c=r.mean_position_error_before_mm,u=r.mean_position_error_mm;return h(pa,{title:"Verdict",good:t.good,text:t.good?o.significant?"The calibration is good.":"The calibration is good, but changes nothing significant.":"The calibration is not good.",children:[t.objections.map(f=>h("p",{children:Xi(f)},f)),h(om,{of:[["Poses",String(t.poses)],["Length residual before",Rs(r.length_residual_before_mm,2,"mm")],["after",Rs(r.length_residual_mm,2,"mm")],...u!=null?[["Position error before",Rs(c,1,"mm")],["after",Rs(u,1,"mm")]]:[],["Uncertainty, 3 sigma",Rs(t.predicted_3_sigma_mm,1,"mm")],["Positions move by",Rs(o.positions_move_by_mm,1,"mm")]]}),t.faults.map(({text:f})=>h("p",{class:"fault",children:Xi(f)},f)),h(am,{job:n,about:"errors at the poses"}),h("details",{children:[h("summary",{children:"Whole verdict"}),h("ul",{children:t.verdict.map(f=>h("li",{children:Xi(f)},f))})]}),t.open.length>0&&h(xt,{children:[h("h3",{class:"next-steps",children:"What to do next"}),h("ul",{children:l.map(f=>h("li",{children:[Xi(f)," ",h("small",{class:"quiet",children:["Not known without it: ",t.open.filter(d=>d.advice===f).map(({what:d})=>d).join("; "),"."]})]},f))})]}),t.good&&h(xt,{children:[!o.significant&&h("label",{class:"consent",children:[h("input",{type:"checkbox",checked:i,onChange:f=>s(f.currentTarget.checked)})," ",h("span",{children:"Adopt the calibration although its changes are not significant."})]}),h("div",{class:"row",children:h("button",{class:"go",disabled:!o.significant&&!i,onClick:()=>{e({procedure:"adopt",measurement:a,insignificant:i})},children:"Adopt"})})]})]})}function am({job:n,about:e}){return h(xt,{children:n.reports.filter(({path:t})=>t.endsWith(".png")).map(({title:t,path:i})=>h("a",{href:i,target:"_blank",rel:"noopener",children:h("img",{class:"drawn",src:i,alt:`${t}: ${e}`})},i))})}function PC({job:n}){let e=n.result;if(!e.gain_m)return null;let t=(i,s,r)=>`${Rs(e[i],3,"",1e3)}\xB1 ${Rs(e[s],3,r,1e3)}`;return h(pa,{title:"Winch",good:!0,text:"The winch is identified.",children:[h(om,{of:[["Gain",t("gain_m","gain_half_width_m","mNm/N")],["Friction",t("friction_Nm","friction_half_width_Nm","mNm")],["Residual, rms",Rs(e.residual_rms_Nm,1,"mNm",1e3)]]}),h(am,{job:n,about:"torque over tension, and the residuals"}),h("pre",{tabIndex:0,children:String(e.calibration??"")})]})}function IC({job:n}){let e=n.result;if(e.rms_px===void 0)return null;let t=e.missing??[];return h(pa,{title:"Lens",good:t.length===0,text:t.length?"The lens is calibrated, but views are missing.":"No more images are needed.",children:[h(om,{of:[["Corners fit to, rms",Rs(e.rms_px,3,"px")],["Images used",String(e.used)],["Focal lengths",(e.focal_px??[]).map(i=>i.toFixed(1)).join(", ")+" px"],["Centre",(e.centre_px??[]).map(i=>i.toFixed(1)).join(", ")+" px"]]}),t.length>0&&h(xt,{children:[h("h3",{class:"next-steps",children:"What to do next"}),h("ul",{children:t.map(i=>h("li",{children:Xi(i)},i))})]}),(e.left_out??[]).map(i=>h("p",{class:"quiet",children:["Left out: ",i]},i)),h(am,{job:n,about:"detected corners over the image, their residuals, and images of the board"})]})}var LC=["unconfigured","inactive","ready"];function Rx(){let{description:n,status:e,connected:t}=ut(),{job:i,start:s}=Kh(),[r,o]=Ce([]),[a,l]=Ce(!0),[c,u]=Ce(!1);if(!n||!e)return null;let f=n.axes.map(({name:v})=>v).filter(v=>r.includes(v)),d=!n.simulated&&!LC.includes(e.state),p=t&&f.length>0&&c&&!d&&!i?.running,g=()=>{u(!1),s({procedure:"commission",axes:f,quick:a,detached:!0})};return h("div",{class:"columns",children:[h("div",{class:"column wide",children:h("section",{class:"card","aria-labelledby":"commission",children:[h("h2",{id:"commission",children:"Commission motors"}),h("ol",{class:"guide",children:[h("li",{children:h(DC,{description:n,axes:f,choose:o})}),h("li",{children:h("fieldset",{children:[h("legend",{children:"How thoroughly"}),h("label",{class:"consent",children:[h("input",{type:"radio",name:"plan",checked:a,onChange:()=>l(!0)})," ",h("span",{children:"Quick: a rough result after about 4 min for each motor"})]}),h("label",{class:"consent",children:[h("input",{type:"radio",name:"plan",checked:!a,onChange:()=>l(!1)})," ",h("span",{children:"Thorough: about 20 min for each motor"})]})]})}),h("li",{children:[h("h3",{children:"What will happen"}),h("p",{children:"One motor after the other finds its encoder index, turns slowly both ways, then at up to 600 deg/s, and refines the result. It then follows a ramp with and without compensation. It gets at most a quarter of its rated torque."}),h("p",{class:"quiet",children:n.simulated?"The robot is simulated: the measurement runs on separate simulated motors, without cables.":"The control loop releases the bus for this time, and takes it again afterwards. The power is off at the end."})]}),h("li",{children:[h("h3",{children:"Detach the motors"}),h("label",{class:"consent",children:[h("input",{type:"checkbox",checked:c,disabled:!f.length,onChange:v=>u(v.currentTarget.checked)}),h("span",{children:["The cables are off the drums, the ",f.length>1?"motors turn":"motor turns"," freely, and nobody is near."]})]})]}),h("li",{children:[h("button",{class:"go",disabled:!p,onClick:g,children:["Commission",f.length?` ${f.join(", ")}`:""]}),f.length?!c&&h("p",{class:"quiet",children:"Confirm that its cable is off."}):h("p",{class:"quiet",children:"Choose a motor first."}),d&&h("p",{class:"fault",children:"Switch the power off first: the motors are in use."})]})]})]})}),h("div",{class:"column",children:[i?.procedure==="commission"&&h(jh,{job:i,curves:!0}),i?.procedure==="commission"&&!i.running&&i.result&&h(UC,{job:i}),i?.running&&i.procedure!=="commission"&&h("section",{class:"card",children:h("p",{children:[i.client," runs another procedure: ",i.what,"."]})}),i?.procedure!=="commission"&&h(NC,{})]})]})}function DC({description:n,axes:e,choose:t}){let i=n.axes.map(({name:s})=>s);return h("fieldset",{children:[h("legend",{children:"Motors"}),h("div",{class:"choice",children:n.axes.map(({name:s,motor:r})=>h("label",{class:"consent",children:[h("input",{type:"checkbox",checked:e.includes(s),onChange:o=>t(o.currentTarget.checked?[...e,s]:e.filter(a=>a!==s))}),h("span",{children:[s," ",h("small",{class:"quiet",children:r})]})]},s))}),h("button",{class:"plain",onClick:()=>t(e.length===i.length?[]:i),children:e.length===i.length?"Choose none":"Choose all"})]})}function NC(){return h("section",{class:"card","aria-labelledby":"about",children:[h("h2",{id:"about",children:"What it is for"}),h("p",{children:"Permanent magnets pull a rotor into preferred positions. This cogging and the motor's friction disturb slow motions. Commissioning measures both, so that the control can compensate them."}),h("p",{class:"quiet",children:"Nothing has been measured since the daemon was started."})]})}function UC({job:n}){let e=n.result.axes;return e?h(xt,{children:[Object.entries(e).map(([t,i])=>h(OC,{name:t,found:i},t)),h("section",{class:"card","aria-labelledby":"use",children:[h("h2",{id:"use",children:"Use it"}),h("p",{children:"Start the robot with the measured motors:"}),h("pre",{tabIndex:0,children:["cdpr run ",String(n.values.robot)," --commissioned ",String(n.values.folder)]})]})]}):null}var Cx=[["rms_position_error","Position error, rms",n=>`${n.rms_position_error_deg.toFixed(4)} deg`],["peak_pid_effort","Effort, peak",n=>`${(1e3*n.peak_pid_effort_Nm).toFixed(1)} mNm`],["peak_velocity_error","Velocity error, peak",n=>`${n.peak_velocity_error_deg_s.toFixed(2)} deg/s`]];function OC({name:n,found:e}){let{identification:t,validation:i}=e,s=i.targets.harmonic??{},r=Cx.filter(([o])=>(i.harmonic.ratios[o]??1/0)<(s[o]??0));return h("section",{class:"card","aria-label":`Result of ${n}`,children:[h("h2",{children:n}),h("p",{class:r.length?"busy":"on",children:h("strong",{children:r.length?`Below its target: ${r.map(([,o])=>o.toLowerCase()).join("; ")}. The report explains why.`:"All targets are reached."})}),h("div",{class:"scroll",tabIndex:0,children:h("table",{children:[h("thead",{children:h("tr",{children:[h("th",{children:"slow ramp"}),h("th",{children:"without"}),h("th",{children:"compensated"}),h("th",{children:"smaller"})]})}),h("tbody",{children:Cx.map(([o,a,l])=>h("tr",{children:[h("td",{children:a}),h("td",{children:l(i.none)}),h("td",{children:l(i.harmonic)}),h("td",{children:[i.harmonic.ratios[o]?.toFixed(1)??"\u2013"," times"]})]},o))})]})}),h("p",{class:"quiet",children:["Cogging: ",t.orders.map((o,a)=>`order ${o}, ${(1e3*t.amplitudes_Nm[a]).toFixed(1)} \xB1 ${(1e3*t.confidence_Nm[a]).toFixed(1)} mNm`).join("; ")||"none found","."," ","Friction ",(1e3*t.coulomb_forward_Nm).toFixed(0)," mNm forward, ",(1e3*t.coulomb_backward_Nm).toFixed(0)," mNm backward."]})]})}var FC=350,Ix="cdpr-described",Lx=[{title:"Robot",keys:/^(kind|name|frame_m|mass_kg)$/},{title:"Exit points",about:"Where the cables leave the frame. The numbers are those in the picture.",keys:/^exit_/},{title:"Anchor points",about:"Where the cables end on the platform, from its middle.",keys:/^(side_m|anchor_)/},{title:"Targets",about:"The box of targets, and where the platform stands at rest.",keys:/^(low_m|high_m|home_m|angle_deg)$/},{title:"Tensions and torques",keys:/^(torque_Nm|tension_)/},{title:"Speeds",keys:/^(speed|acceleration|angular)/},{title:"Winches and buses",keys:/./}],kC=n=>Lx.findIndex(({keys:e})=>e.test(n));function BC(n,e){let t=(n.split(".").pop()??"").replace(/\[.*/,""),i=/axes\[(\d+)\]/.exec(n)?.[1],s={workspace_min_m:"low_m",workspace_max_m:"high_m",workspace_angle_rad:"angle_deg",node_id:"nodes"},r=i&&/^(exit|anchor)_point_m$/.test(t)?`${t.split("_")[0]}_${Number(i)+1}_m`:s[t]??t;return e.some(o=>o.key===r)?r:""}var zC=()=>{try{return JSON.parse(sessionStorage.getItem(Ix)??"{}")}catch{return{}}};function Dx(){let[n,e]=Ce(zC),[t,i]=Ce(null),[s,r]=Ce(null),[o,a]=Ce(""),[l,c]=Ce(0),u=$t(0),f=p=>{e(p),sessionStorage.setItem(Ix,JSON.stringify(p))};at(()=>{let p=++u.current,g=setTimeout(()=>{(async()=>{try{r(null),a("");let v=await Ct("POST","/robot-file",{answers:n});if(p!==u.current)return;i(v);let m=await Ct("POST","/robot-file",{answers:n,diagnose:!0});p===u.current&&r(m)}catch(v){if(!(v instanceof $n))throw v;p===u.current&&a(v.message)}})()},FC);return()=>clearTimeout(g)},[JSON.stringify(n),l]);let d=()=>me.attempt(async()=>{let p=await Ct("POST","/robot-file",{answers:{},present:!0});f(Object.fromEntries((p.questions??[]).filter(g=>g.value!==g.default||g.key==="kind").map(g=>[g.key,g.value]))),i(p)});return h("div",{class:"columns describe",children:[h("div",{class:"column",children:[h("section",{class:"card","aria-labelledby":"describe",children:[h("h2",{id:"describe",children:"Describe a robot"}),h("p",{children:"Each field has a default that follows from the fields before it. Change what differs."}),h("div",{class:"row",children:[h("button",{onClick:()=>f({}),children:"Start again"}),h(VC,{start:()=>{d()}})]}),(t?.notes?.length??0)>0&&h("p",{class:"busy",children:["The form leaves out of the present robot: ",t.notes.join(", "),". Add them to the file."]}),o&&h("p",{class:"fault",role:"alert",children:[o," ",h("button",{class:"plain",onClick:()=>c(l+1),children:"Try again"})]}),!t&&!o&&h("p",{class:"quiet",children:"Starting the computation. This takes some seconds."})]}),t&&h(GC,{questions:t.questions??[],answers:n,answer:f})]}),h("div",{class:"column picture",children:[t&&h(XC,{platform:t.platform}),!o&&h(qC,{found:s,questions:t?.questions??[]}),t&&h($C,{shown:t,answers:n})]})]})}function VC({start:n}){let{description:e}=ut();return e?.platform?h("button",{onClick:n,children:["Start from ",e.robot]}):null}function GC({questions:n,answers:e,answer:t}){let i=(s,r)=>{let{[s]:o,...a}=e;t(s==="kind"?r?{kind:r}:{}:r===null?a:{...a,[s]:r})};return h(xt,{children:Lx.map(({title:s,about:r},o)=>{let a=n.filter(({key:l})=>kC(l)===o);return a.length>0&&h(HC,{title:s,about:r,children:a.map(l=>h(WC,{question:l,typed:e[l.key],set:c=>i(l.key,c)},l.key))},s)})})}function HC({title:n,about:e,children:t}){return h("section",{class:"card","aria-label":n,children:[h("h2",{children:n}),e&&h("p",{class:"quiet",children:e}),h("div",{class:"fields",children:t})]})}var Px=({key:n,text:e})=>{let t=/^(?:exit|anchor)_(\d+)_m$/.exec(n);return t?`Cable ${t[1]}`:e.replace(/ \(`cdpr.*\)$/,"").replace(/^Winches:.*/,"Winches")};function WC({question:n,typed:e,set:t}){let{key:i,problem:s,choices:r,origin:o}=n,a=`hint-${i}`,l=e??n.value,c={id:`field-${i}`,value:l,"aria-describedby":a,"aria-invalid":s!==""};return h("div",{class:`field ${s?"wrong":e?"typed":"default"}`,children:[h("label",{for:`field-${i}`,children:Px(n)}),r.length>0?h("select",{...c,onChange:u=>t(u.currentTarget.value),children:r.map(u=>h("option",{children:u},u))}):h("input",{...c,autocomplete:"off",spellcheck:!1,onInput:u=>t(u.currentTarget.value)}),h("small",{id:a,children:[s||(e&&e!==n.default?"changed":o&&`default: ${o}`),e&&e!==n.default&&h(xt,{children:[" ",h("button",{class:"plain",type:"button","aria-label":`Use the default of ${Px(n)}`,onClick:()=>t(null),children:["use ",n.default]})]})]})]})}function XC({platform:n}){let e=$t(null),t=$t(null);return at(()=>(t.current=Rh(e.current),t.current&&(t.current.numbered=!0),()=>t.current?.close()),[]),at(()=>{let i=n.exit_points_m.map(()=>null);t.current?.describe({platform:n,limits:{tension_min_N:i,tension_max_N:i}})},[JSON.stringify(n)]),h("section",{class:"card robot","aria-label":"The described robot in three dimensions",children:[h("div",{class:"scene",ref:e}),h("p",{class:"place",children:"at rest; the dashed box limits the targets"})]})}function qC({found:n,questions:e}){let t=n?.findings??[],i=t.filter(a=>a.impossible).length,s=n?.figures??{},r=a=>a===void 0?"\u2013":`${Math.floor(100*a)} %`,o=a=>document.getElementById(`field-${a}`)?.focus();return h("section",{class:"card","aria-labelledby":"diagnosis",children:[h("h2",{id:"diagnosis",children:"Diagnosis"}),h("p",{"aria-live":"polite",class:n?i?"fault":t.length?"busy":"on":"quiet",children:h("strong",{children:n?i?"This robot cannot work.":t.length?"It can work, but see the warnings.":"It can work. No problems found.":"Computing \u2026"})}),t.length>0&&h("ul",{class:"findings",children:t.map(a=>{let l=BC(a.key,e);return h("li",{class:a.impossible?"fault":"busy",children:[h("code",{children:a.key})," ",h("span",{children:a.text})," ",l&&h("button",{class:"plain",onClick:()=>o(l),children:"Go to the field"})]},a.key+a.text)})}),n&&s.held_share!==void 0&&h("dl",{class:"key-figures",children:[h("div",{children:[h("dt",{children:"Held in the box"}),h("dd",{children:r(s.held_share)})]}),h("div",{children:[h("dt",{children:"Accepted as targets"}),h("dd",{children:r(s.target_share)})]}),h("div",{children:[h("dt",{children:"Lowest resonance"}),h("dd",{children:[s.lowest_resonance_Hz?.toFixed(0)," Hz"]})]}),h("div",{children:[h("dt",{children:"Longest cable"}),h("dd",{children:[s.longest_cable_m?.toFixed(2)," m"]})]})]})]})}var YC=/^[a-z0-9][a-z0-9_-]{0,39}$/;function $C({shown:n,answers:e}){let[t,i]=Ce("my-robot"),[s,r]=Ce(""),[o,a]=Ce(""),l=n.toml??"",c=YC.test(t),u=async d=>{r(""),a("");try{let{file:p}=await Ct("PUT","/robot-file",{answers:e,name:t,replace:d,client:Wn()});r(p)}catch(p){if(!(p instanceof $n))throw p;p.message.includes("already exists")?a(p.message):me.change({rejected:p.message})}},f=()=>{let d=document.createElement("a");d.href=URL.createObjectURL(new Blob([l],{type:"application/toml"})),d.download=`${t}.toml`,d.click(),setTimeout(()=>URL.revokeObjectURL(d.href),1e4)};return h("section",{class:"card","aria-labelledby":"file",children:[h("h2",{id:"file",children:"The robot's file"}),h("div",{class:"fields one",children:h("div",{class:`field ${c?"typed":"wrong"}`,children:[h("label",{for:"file-name",children:"Name of the file"}),h("input",{id:"file-name",value:t,autocomplete:"off",spellcheck:!1,"aria-invalid":!c,"aria-describedby":"file-hint",onInput:d=>{i(d.currentTarget.value),a("")}}),h("small",{id:"file-hint",children:c?`${n.folder}/${t}.toml`:"Allowed: lower-case letters, digits, - and _"})]})}),h("div",{class:"row",children:[h("button",{class:"go",disabled:!c||!n.writable,onClick:()=>{u(!1)},children:"Save"}),h("button",{disabled:!c,onClick:f,children:"Download"})]}),!n.writable&&h("p",{class:"busy",children:["The daemon cannot write into ",n.folder,". Download the file."]}),o&&h("p",{class:"busy",role:"alert",ref:d=>d?.scrollIntoView({block:"nearest"}),children:["A file of this name exists. ",h("button",{onClick:()=>{u(!0)},children:"Replace it"})]}),s&&h("p",{class:"on",role:"status",ref:d=>d?.scrollIntoView({block:"nearest"}),children:["Saved. Try it: ",h("code",{children:["cdpr run ",t," --bus simbus: --open"]})]}),h("details",{children:[h("summary",{children:"Show the file"}),h("pre",{tabIndex:0,children:l})]})]})}var ZC=1e3,Qh=(n,e=2)=>typeof n=="number"?`${(1e3*n).toFixed(e)} ms`:"\u2013",Nx=(n,e)=>typeof n=="number"?n.toFixed(e):"\u2013";function Ox(){let{status:n}=ut(),[e,t]=Ce(null),[i,s]=Ce(""),[r,o]=Ce(0);at(()=>Ir(async()=>{if(document.visibilityState==="visible")try{t(await Ct("GET","/drives")),s("")}catch(l){s(l.message)}},ZC),[]);let a=e?.drives[r];return h("div",{class:"columns drives-first",children:[h("div",{class:"column wide",children:[h(JC,{why:i,drives:e?.drives??[],status:n,axis:r,choose:o}),a&&h(KC,{drive:a}),a&&h(QC,{axis:r,drive:a,status:n},r)]}),h("div",{class:"column",children:[h(eR,{buses:e?.buses??[],status:n}),h(tR,{status:n}),h(nR,{names:e?.drives.map(l=>l.name)??[]})]})]})}function JC({why:n,drives:e,status:t,axis:i,choose:s}){let r=t?.count?.heartbeat_age_s??[],o=t?.faults??[];return h("section",{class:"card","aria-labelledby":"drive-states",children:[h("h2",{id:"drive-states",children:"Drives"}),n?h("p",{class:"fault",children:n}):!e.length&&h("p",{class:"quiet",children:"No drive has answered yet."}),h("ul",{class:"drives",children:e.map((a,l)=>{let c=t?.axes[l]??{},u=o.find(d=>d.axis===l),f=c.alive===!1?"silent":c.valid===!1?"no answer in the last cycle":"answers";return h("li",{children:h("button",{class:"drive","aria-pressed":l===i,onClick:()=>s(l),children:[h("strong",{children:a.name}),h("span",{children:a.state}),u&&h("span",{class:"fault",children:u.text}),h("small",{children:["node ",a.node_id," on ",a.bus,", ",f,", heartbeat ",r[l]===void 0?"\u2013":`${(1e3*r[l]).toFixed(0)} ms ago`,", torque ",Nx(c.torque_actual_Nm,3)," Nm, tension ",Nx(c.tension_N,1)," N"]})]})},a.name)})})]})}function KC({drive:n}){return h("section",{class:"card","aria-labelledby":"bits",children:[h("h2",{id:"bits",children:["Statusword of ",n.name]}),h("p",{class:"quiet note",children:[n.drive,". Mode of operation with power: ",n.mode,"."]}),h("ul",{class:"bits",children:n.bits.map(({bit:e,name:t,on:i})=>h("li",{class:i?"set":"",children:[h("code",{children:e})," ",t,h("span",{class:"hidden",children:[": ",i?"set":"not set"]})]},e))})]})}var jC=[[24639,0],[4097,0],[24673,0],[24641,0],[24697,0],[24696,0],[24695,0],[24676,0],[4104,0],[4106,0]],Ux=n=>`${n.toString(16).toUpperCase().padStart(4,"0")}h`;function QC({axis:n,drive:e,status:t}){let[i,s]=Ce([]),[r,o]=Ce("6072"),[a,l]=Ce("0"),[c,u]=Ce(""),[f,d]=Ce(""),[p,g]=Ce(!1),v=/^(0x)?[0-9a-f]{1,4}h?$/i.test(r.trim())?parseInt(r.trim().replace(/^0x/i,""),16):NaN,m=Number(a),_=Number.isFinite(v)&&/^\d{1,3}$/.test(a.trim())&&m<=255,x=/^(-?\d+|0x[0-9a-f]+)$/i.test(c.trim())&&Number.isSafeInteger(Number(c)),T=f.trim().toLowerCase()===r.trim().toLowerCase()&&f!=="",S=t?.state==="ready"||t?.state==="inactive",R=async y=>{g(!0);for(let[M,N]of y){let P;try{P={index:M,sub:N,why:"",answer:await Ct("POST","/object",{axis:n,index:M,sub:N,client:Wn()})}}catch(D){P={index:M,sub:N,why:D.message,answer:null}}s(D=>[...D.filter(z=>z.index!==M||z.sub!==N),P])}g(!1)},C=()=>{g(!0),me.attempt(async()=>{await me.right.request("/object",{axis:n,index:v,sub:m,value:Number(c),client:Wn()}),d(""),await R([[v,m]])}).finally(()=>g(!1))};return h("section",{class:"card","aria-labelledby":"objects",children:[h("h2",{id:"objects",children:["Objects of ",e.name]}),h("div",{class:"row",children:[h("label",{children:["Object ",h("input",{class:"number",value:r,"aria-label":"Index of the object, hexadecimal",onInput:y=>o(y.currentTarget.value)})]}),h("label",{children:[": ",h("input",{class:"short",inputMode:"numeric",value:a,"aria-label":"Sub-index",onInput:y=>l(y.currentTarget.value)})]}),h("button",{disabled:!_||p,onClick:()=>{R([[v,m]])},children:"Read"}),h("button",{disabled:p,onClick:()=>{R(jC)},children:"Read error, mode, voltage, current"})]}),i.length>0&&h("div",{class:"scroll",tabIndex:0,role:"region","aria-label":"Values of objects",children:h("table",{children:[h("thead",{children:h("tr",{children:[h("th",{children:"object"}),h("th",{children:"name"}),h("th",{children:"value"})]})}),h("tbody",{children:i.map(({index:y,sub:M,answer:N,why:P})=>h("tr",{children:[h("td",{children:h("code",{children:[Ux(y),":",M]})}),h("td",{children:N?.name||"\u2013"}),h("td",{class:N?"wrap":"wrap fault",title:N?.raw,children:N?N.text:P})]},`${y}:${M}`))})]})}),h("details",{children:[h("summary",{children:"Write an object"}),h("p",{class:"quiet note",children:"A wrong value can make a drive move or fail later. Only integers, only without power. Then all drives boot again: the boot restores the settings in the robot's file, and the platform must be tightened again."}),!S&&h("p",{class:"note",children:["Remove the power first: the robot is ",t?.state??"not connected","."]}),h("fieldset",{disabled:!S||p,children:[h("legend",{class:"hidden",children:"Write an object"}),h("div",{class:"row",children:[h("label",{children:["Value ",h("input",{class:"number",value:c,onInput:y=>u(y.currentTarget.value)})]}),h("label",{children:["Type ",r," again to agree ",h("input",{class:"number",value:f,onInput:y=>d(y.currentTarget.value)})]}),h("button",{disabled:!_||!x||!T,onClick:C,children:["Write ",_?`${Ux(v)}:${m}`:""]})]})]})]})]})}function eR({buses:n,status:e}){let t=e?.buses??{};return h("section",{class:"card","aria-labelledby":"buses",children:[h("h2",{id:"buses",children:"Buses"}),n.map(({name:i,load:s,bitrate_bit_s:r})=>{let o=Object.entries(t[i]?.counts??{}).map(([a,l])=>`${l} ${a.replaceAll("_"," ")}`);return h("div",{class:"bus",children:[h("strong",{children:i})," ",h("span",{class:"quiet",children:[t[i]?.url,", ",r/1e3," kbit/s"]}),h("meter",{min:0,max:1,low:.7,high:.9,optimum:0,value:s,"aria-label":`Planned load of ${i}`}),h("small",{children:[(100*s).toFixed(0)," % of each cycle planned for frames, in the worst case. ",t[i]?.state||"No errors",o.length>0&&`: ${o.join(", ")}`]})]},i)})]})}function tR({status:n}){let e=n?.count,t=n?.cycle??{},i=[["Answers missed",String(e?.missed??"\u2013")],["Cycles that began late",`${e?.late??"\u2013"} of ${e?.cycles??"\u2013"}`],["Largest lateness",Qh(e?.worst_late_s)],["Lateness now",Qh(t.lateness_s)],["SYNC to the last answer",Qh(t.exchange_s)],["Last answer to the last command",Qh(t.compute_s)]];return h("section",{class:"card","aria-labelledby":"timing",children:[h("h2",{id:"timing",children:"Timing of the cycles"}),h("dl",{class:"pairs",children:i.map(([s,r])=>h("div",{children:[h("dt",{children:s}),h("dd",{children:r})]},s))})]})}function nR({names:n}){let{events:e}=ut(),[t,i]=Ce(""),s=t?e.filter(r=>r.text.includes(t)):e;return h("section",{class:"card","aria-labelledby":"events",children:[h("h2",{id:"events",children:"Events"}),h("div",{class:"row",children:h("label",{children:["Of ",h("select",{value:t,onChange:r=>i(r.currentTarget.value),children:[h("option",{value:"",children:"everything"}),n.map(r=>h("option",{value:r,children:r},r))]})]})}),s.length===0&&h("p",{class:"quiet",children:["No event",t&&` names ${t}`,"."]}),h("ol",{class:"events",tabIndex:0,"aria-labelledby":"events",children:s.map(r=>h(nm,{event:r,exact:!0},r.number))})]})}var iR=5e3,lm=50,sR=n=>n<1e6?`${(n/1e3).toFixed(0)} kB`:n<1e9?`${(n/1e6).toFixed(1)} MB`:`${(n/1e9).toFixed(2)} GB`;function rR(n){let e=Math.round(n),t=[Math.floor(e/3600),Math.floor(e/60)%60,e%60];return t[0]?`${t[0]} h ${t[1]} min`:t[1]?`${t[1]} min ${t[2]} s`:`${t[2]} s`}var oR=n=>new Date(n.begin).toLocaleString(void 0,{dateStyle:"medium",timeStyle:"medium"});function Fx(){let{status:n}=ut(),[e,t]=Ce(null),[i,s]=Ce(lm);at(()=>Ir(async()=>{if(document.visibilityState==="visible")try{t((await Ct("GET","/recordings")).recordings)}catch{}},iR),[]);let r=n?.parts.recording;return h("section",{class:"card","aria-labelledby":"recordings",children:[h("h2",{id:"recordings",children:"Recordings"}),!r&&h("p",{class:"quiet",children:["Nothing is recorded: the daemon was started with ",h("code",{children:"--no-record"}),"."]}),r&&!r.recording&&h("p",{class:"fault",children:["Not recording: ",r.error||"ended"]}),e?.length===0&&r&&h("p",{class:"quiet",children:"There are no recordings of this robot yet."}),h("ul",{class:"recordings",children:e?.slice(0,i).map(o=>h(aR,{one:o},o.name))}),e&&e.length>i&&h("div",{class:"row",children:h("button",{onClick:()=>s(i+lm),children:["Show ",Math.min(lm,e.length-i)," more of ",e.length]})}),h("p",{class:"quiet note",children:["Every cycle is recorded. MCAP files open in Foxglove and in ",h("code",{children:"cdpr log"}),"; CSV is a table of all cycles, about five times as large."]})]})}function aR({one:n}){let e=`/recordings/${encodeURIComponent(n.name)}`,[t,i]=Ce(!1),s=r=>()=>{i(r!==""),me.attempt(()=>dg(`${e}${r}`))};return h("li",{children:[h("div",{children:[h("strong",{children:oR(n)})," ",n.live&&h("span",{class:"live",children:"being recorded"}),h("small",{children:[rR(n.duration_s),", ",sR(n.bytes),", ",h("code",{children:n.name})]}),t&&h("small",{role:"status",children:"The daemon reads the recording. Then the browser saves the file."})]}),h("div",{class:"row",role:"group","aria-label":n.name,children:[h("a",{class:"button",href:Zi("scope",{file:n.name}),children:"Plot"}),h("button",{onClick:s(""),children:"Download MCAP"}),h("button",{onClick:s("/table.csv"),children:"Download CSV"}),h("button",{onClick:s("/picture.png"),children:"Download picture"})]})]})}var lR=["x","y","z","qw","qx","qy","qz"],cR=3,kx=[["_rad_s","rad/s"],["_m_s","m/s"],["_rad","rad"],["_Nm","Nm"],["_N","N"],["_m","m"],["_ns","ns"],["_s","s"]],Vl=n=>{let e=kx.find(([t])=>n.endsWith(t));return(e?n.slice(0,-e[0].length):n).replaceAll("_"," ")},cm=n=>kx.find(([e])=>n.endsWith(e))?.[1]??"";function Bx({name:n,per:e,labels:t},i){let s={field:n,labels:t??null},r=(a,l)=>l?`${a}, ${l}`:a;return e==="robot"?[{...s,id:n,label:r(Vl(n),cm(n)),index:null,unit:cm(n)}]:(e==="pose"?lR:i.axes.map(a=>a.name)).map((a,l)=>{let c=e==="axis"?cm(n):l<cR?"m":"",u=e==="axis"?`${Vl(n)} of ${a}`:`${a} of the ${Vl(n)}`;return{...s,id:`${n}[${a}]`,label:r(u,c),index:l,unit:c}})}var hs=n=>n==null?"\u2013":n!==0&&(Math.abs(n)<.001||Math.abs(n)>=1e6)?n.toExponential(3).replace(/\.?0+e/,"e"):String(+n.toPrecision(6));function td({time_s:n,values:e},t,i){let s=ma(n,t),r=ma(n,i)+1;return{time_s:n.slice(s,r),values:e.map(o=>o.slice(s,r))}}function ma(n,e){let t=0,i=n.length;for(;t<i;){let s=t+i>>1;n[s]<e?t=s+1:i=s}return t}var uR=45,hR=20,dR=.1,um=.2,fR=1e3,ed=class{constructor(e,t,i){this.curves=e;this.arrived=i;let s=t?.samples.time_s??[],r=o=>t?.samples.values[t.curves.findIndex(a=>a.id===o)];this.samples={time_s:s,values:e.map(({id:o})=>r(o)??s.map(()=>null))},this.#s()}curves;arrived;samples;triggered_s=null;refused="";#e=-1/0;#t=null;#i=null;#n=!1;close(){this.#n=!0,this.#i?.close()}async#s(){let e=[...new Set(["time_s",...this.curves.map(t=>t.field)])].join();for(;!this.#n;){try{let t=this.#i=await sc("/live",{rate_Hz:String(hR),fields:e,all_cycles:"true"});this.#n&&t.close(),await new Promise(i=>{t.onmessage=({data:s})=>this.#r(JSON.parse(s)),t.onclose=({reason:s})=>{this.refused=s,this.arrived(),i()}})}catch{}await new Promise(t=>setTimeout(t,fR))}}#r(e){if(e.kind!=="cycles"||this.#n)return;this.refused="";let{time_s:t,values:i}=this.samples;for(let r of e.rows){let o=r.time_s;t.length&&o<=t[t.length-1]&&(this.samples.time_s.length=0,i.forEach(l=>l.length=0),this.rearm());let a=t[t.length-1];a!==void 0&&o-a>dR&&(t.push(a+1e-6),i.forEach(l=>l.push(null))),t.push(o),this.curves.forEach(({field:l,index:c},u)=>{let f=r[l],d=c===null?f:f[c];i[u].push(d==null?null:Number(d))})}let s=ma(t,t[t.length-1]-uR);s>t.length/8&&(t.splice(0,s),i.forEach(r=>r.splice(0,s))),this.arrived()}rearm(){let{time_s:e}=this.samples;this.triggered_s=null,this.#e=e[e.length-1]??-1/0,this.#t=null}window(e,t){let{time_s:i}=this.samples,s=i[i.length-1]??0,r=i[0]??0;if(e.mode==="off")return s-r<t?[r,r+t]:[s-t,s];let o=this.triggered_s;(o===null||!e.once&&s>=o+t*(1-um))&&(this.triggered_s=this.#o(e)??o);let a=this.triggered_s;return a===null?null:[a-um*t,a+(1-um)*t]}#o({mode:e,curve:t,level:i,rising:s}){let{time_s:r,values:o}=this.samples,a=this.curves.findIndex(u=>u.id===t),l=o[a];if(!l)return null;let c=u=>s?u>=i:u<=i;for(let u=ma(r,this.#e+1e-9);u<l.length;u++){let f=l[u],d=this.#t;if(this.#e=r[u],f!=null&&(this.#t=f,c(f)&&(e==="level"||d!==null&&!c(d))))return r[u]}return null}},pR=.02,mR=.1,gR=n=>n.reduce((e,t)=>e+t,0)/n.length;function hm({time_s:n,values:e},t){let i=n.map((d,p)=>[d,e[t]?.[p]]).filter(([,d])=>d!=null);if(i.length<10)return null;let s=i[0][1],r=gR(i.slice(-Math.ceil(mR*i.length)).map(([,d])=>d)),o=r-s;if(Math.abs(o)<1e-12)return null;let a=i.map(([d,p])=>[d,(p-s)/o]),l=d=>a.find(([,p])=>p>=d)?.[0]??null,c=l(.1),u=l(.9),f=a.map(([,d])=>Math.abs(d-1)>pR).lastIndexOf(!0);return{from:s,to:r,rise_s:c===null||u===null?null:u-c,overshoot:Math.max(0,Math.max(...a.map(([,d])=>d))-1),settling_s:f+1<a.length?a[f+1][0]-n[0]:null}}var zx=({time_s:n,values:e},t)=>[["time_s",...t.map(i=>`"${i.id}"`)],...n.map((i,s)=>[i,...e.map(r=>r[s]??"")])].map(i=>i.join()).join(`
`)+`
`;var nd=n=>getComputedStyle(document.documentElement).getPropertyValue(n).trim(),_R=["A","B"],Vx="11px system-ui",id=class{#e;#t;#i=[null,null];constructor(e,t,i){let s=[...new Set(t.map(a=>a.unit))],r={stroke:()=>nd("--muted"),ticks:{show:!1},font:Vx,labelFont:Vx},o=0;this.#e=new xn({width:e.clientWidth||600,height:e.clientHeight||320,legend:{show:!1},cursor:{y:!1,drag:{x:!0,y:!1,setScale:!1}},scales:{x:{time:!1},...Object.fromEntries(s.map(a=>[dm(a),{}]))},axes:[{...r,size:34,grid:{width:1,stroke:()=>nd("--line")},values:(a,l)=>l.map(c=>`${+c.toFixed(6)} s`)},...s.map((a,l)=>({...r,scale:dm(a),side:l%2?1:3,size:60,values:(c,u)=>u.map(hs),label:a||"\u2013",labelSize:16,grid:{width:1,show:l===0,stroke:()=>nd("--line")}}))],series:[{},...t.map(({id:a,unit:l},c)=>({label:a,scale:dm(l),stroke:Js(c),width:1.5,points:{show:!1}}))],hooks:{setSelect:[a=>{let{left:l,width:c}=a.select;c>3&&i.zoomed(a.posToVal(l,"x"),a.posToVal(l+c,"x")),a.setSelect({left:0,top:0,width:0,height:0},!1)}],draw:[a=>this.#n(a)]}},[[],...t.map(()=>[])],e),this.#e.over.addEventListener("pointerdown",a=>o=a.clientX),this.#e.over.addEventListener("click",a=>{Math.abs(a.clientX-o)<4&&i.pressed(this.#e.posToVal(a.offsetX,"x"))}),this.#t=new ResizeObserver(()=>{e.clientWidth&&this.#e.setSize({width:e.clientWidth,height:e.clientHeight})}),this.#t.observe(e)}show(e,t,i){this.#i=i,this.#e.setData([e.time_s,...e.values],!1),this.#e.setScale("x",{min:t[0],max:t[1]})}#n({ctx:e,bbox:t,valToPos:i}){e.save(),e.textAlign="left",e.textBaseline="alphabetic",e.font=`${12*devicePixelRatio}px system-ui`,this.#i.forEach((s,r)=>{if(s===null)return;let o=i(s,"x",!0);o<t.left||o>t.left+t.width||(e.strokeStyle=e.fillStyle=nd("--text"),e.setLineDash(r?[6,4]:[]),e.beginPath(),e.moveTo(o,t.top),e.lineTo(o,t.top+t.height),e.stroke(),e.fillText(_R[r],o+4*devicePixelRatio,t.top+13*devicePixelRatio))}),e.restore()}close(){this.#t.disconnect(),this.#e.destroy()}},dm=n=>n||"number";var vR=Math.PI/180,xR=1,yR=.2,bR=.5,SR={mm:[1,2,5,10,20,50],deg:[1,5,20,90]};function MR({platform:n,axes:e}){if(!n)return e.map(({name:i},s)=>({name:i,unit:"deg",ids:[`position_rad[${i}]`,`setpoint_rad[${i}]`],program:"pid",wanted:r=>({distance_rad:e.map((o,a)=>a===s?r*vR:null)})}));let t=ki(n);return t.map((i,s)=>({name:i,unit:"mm",ids:[`pose[${i}]`,`pose_setpoint[${i}]`],program:"pose",wanted:r=>({distance_m:t.map((o,a)=>a===s?r/1e3:0),frame:"room"})}))}var fm=()=>me.recent.at(-1)?.time_s??0;function Gx({description:n,shown:e,show:t,finished:i}){let{status:s,right:r}=ut(),o=MR(n),[a,l]=Ce(o[0].name),[c,u]=Ce(2),[f,d]=Ce(null),p=o.find(M=>M.name===a)??o[0],g=SR[p.unit],v=g[c]??g[0],m=n.platform,_=Lr(),x=m?_||(Od(m,v/1e3)?Ud:""):s?.state==="active"?"":"The motor can turn once the power is on.",T=p.ids.every(M=>e.includes(M)),S=M=>{me.attempt(async()=>{let N=fm();await r.program(p.program,p.wanted(M*v)),d(N)})},R=f!==null&&fm()-f>bR,C=R&&s?.program!==p.program,y=R&&!C&&(Zn(s).done??1)>=1;return at(()=>{if(C&&d(null),!y)return;let M=setTimeout(()=>{d(null),i(f,fm()-yR)},1e3*xR);return()=>clearTimeout(M)},[C,y]),h("section",{class:"card","aria-labelledby":"step",children:[h("h2",{id:"step",children:"Make a step"}),h("p",{class:"quiet",children:x||"The set-point moves by one step as fast as the robot's limits allow. Then the cursors show rise time, overshoot and settling time."}),h("fieldset",{class:"row",disabled:x!==""||f!==null,children:[h("legend",{class:"hidden",children:"Make a step"}),h("label",{children:["Step of ",h("select",{value:p.name,onChange:M=>l(M.currentTarget.value),children:o.map(M=>h("option",{children:M.name},M.name))})]}),h("label",{children:["by ",h("select",{value:c,onChange:M=>u(Number(M.currentTarget.value)),children:g.map((M,N)=>h("option",{value:N,children:[M," ",p.unit]},M))})]}),T?h(xt,{children:[h("button",{onClick:()=>S(-1),children:["Step \u2212",v," ",p.unit]}),h("button",{onClick:()=>S(1),children:["Step +",v," ",p.unit]})]}):h("button",{onClick:()=>t(p.ids),children:"Show position and set-point"}),f!==null&&h("span",{class:"quiet",role:"status",children:"measuring \u2026"})]})]})}var wR=[1,2,5,10,20,40],TR=100,ER=2,AR=6e3,CR=24,Xx={time_s:[],values:[]},Hx={mode:"off",curve:"",level:0,rising:!0,once:!1},Wx="cdpr-scope";function qx(){let{description:n}=ut(),[e,t]=Ce([]);at(()=>{me.attempt(async()=>t((await Ct("GET","/fields")).fields))},[]);let i=Aa(()=>n?e.flatMap(s=>Bx(s,n)):[],[e,n]);return!n||!i.length?h("section",{class:"card",children:h("p",{class:"quiet",children:"Waiting for the robot's description."})}):h(PR,{known:i,quantities:e,description:n})}function RR(n,e){let t=e.platform?"tension_N":"position_rad",[i,s]=Ce(()=>{let o=JSON.parse(sessionStorage.getItem(Wx)??"[]").filter(a=>n.some(l=>l.id===a));return o.length?o:n.filter(a=>a.field===t).map(a=>a.id)}),r=o=>{let a=o.slice(0,CR);sessionStorage.setItem(Wx,JSON.stringify(a)),s(a)};return[Aa(()=>i.flatMap(o=>n.find(a=>a.id===o)??[]),[i,n]),r]}function PR({known:n,quantities:e,description:t}){let i=nc().args.get("file"),[s,r]=RR(n,t),o=s.map(N=>N.id).join(),[a,l]=Ce(Hx),[c,u]=Ce(10),[f,d]=Ce(null),[p,g]=Ce([null,null]),v=DR(i,o,s),m=LR(i===null,o,s,a,c),{samples:_,window:x}=i===null?m:v,T=f??x;at(()=>{d(null),g([null,null])},[i]);let S=i!==null||m.paused,R=(N,P)=>{i===null&&m.pause(),d([N,P])},C=N=>{if(!S)return;let[P,D]=p,z=P===null?0:D===null?1:Math.abs(N-P)<=Math.abs(N-D)?0:1;g(p.map((G,U)=>U===z?N:G))},y=()=>{d(null),g([null,null]),m.proceed()},M=(N,P)=>{R(N-.1*(P-N),P),g([N,P])};return h(xt,{children:[h("section",{class:"card scope","aria-label":"Curves",children:[h("div",{class:"row tools",children:[h("strong",{class:"source",children:i===null?"Live":i}),i===null?h(xt,{children:[m.paused?h("button",{onClick:y,children:"Continue"}):h("button",{onClick:m.pause,children:"Pause"}),h("label",{children:["Time ",h("select",{value:c,onChange:N=>u(Number(N.currentTarget.value)),children:wR.map(N=>h("option",{value:N,children:[N," s"]},N))})]})]}):h(xt,{children:[h("a",{class:"button",href:Zi("scope"),children:"Show live values"}),f&&v.each>1&&h("button",{onClick:()=>v.read(f),children:"Read this stretch in detail"})]}),f&&h("button",{onClick:()=>{d(null),i!==null&&v.read(null)},children:"Show all"}),h("button",{onClick:()=>IR(td(_,...T),s),disabled:!_.time_s.length,children:"Export as CSV"})]}),h(NR,{curves:s,ids:o,samples:_,window:T,cursors:p,zoomTo:R,place:C}),h("p",{class:"quiet note",role:"status",children:i===null?m.text:v.text}),h(UR,{curves:s,known:n,quantities:e,choose:r}),i===null&&h(FR,{trigger:a,change:l,curves:s,rearm:m.rearm})]}),S?h(kR,{samples:_,window:T,curves:s,cursors:p,change:g,zoomTo:R}):h("section",{class:"card",children:[h("h2",{children:"Cursors"}),h("p",{class:"quiet",children:"Pause to place cursors: they show values, differences and the figures of a step response."})]}),i===null&&h(Gx,{description:t,shown:s.map(N=>N.id),finished:M,show:N=>{l(Hx),r(N),y()}}),h(zR,{})]})}function IR(n,e){let t=URL.createObjectURL(new Blob([zx(n,e)],{type:"text/csv"}));Pd(t,"scope.csv"),setTimeout(()=>URL.revokeObjectURL(t),1e4)}function LR(n,e,t,i,s){let[r,o]=Ce({samples:Xx,window:[0,1]}),[a,l]=Ce(!1),[c,u]=Ce(""),f=$t(null),d=$t({trigger:i,span_s:s,paused:a});d.current={trigger:i,span_s:s,paused:a},at(()=>{if(!n||!t.length)return;let g=0,v=0;l(!1);let m=f.current=new ed(t,f.current,()=>{let{trigger:_,span_s:x,paused:T}=d.current,S=performance.now();if(T||S-g<Math.max(TR,ER*v))return;g=S,requestAnimationFrame(()=>setTimeout(()=>v=performance.now()-S));let R=m.window(_,x);if(u(m.refused?`${m.refused}.`:_.mode==="off"?"":R?`Triggered at ${m.triggered_s.toFixed(3)} s`:"Waiting for the trigger"),!R)return;o({samples:td(m.samples,...R),window:R});let C=m.samples.time_s[m.samples.time_s.length-1];_.mode!=="off"&&_.once&&C>=R[1]&&l(!0)});return()=>m.close()},[n,e]),at(()=>{f.current?.rearm(),i.mode!=="off"&&l(!1)},[i]);let p=()=>{f.current?.rearm(),l(!1)};return{...r,text:a?"Paused. Drag across the curves to zoom, press on them to place a cursor.":c,paused:a,pause:()=>l(!0),proceed:p,rearm:p}}function DR(n,e,t){let[i,s]=Ce(null),[r,o]=Ce(""),a=$t(0),l=f=>{if(n===null||!t.length)return;let d=++a.current,p=[...new Set(t.map(v=>v.field))].join(),g=f?`&from_s=${Math.max(0,f[0])}&until_s=${f[1]}`:"";o("Reading the recording. A long one takes a minute."),me.attempt(async()=>{try{let v=await Ct("GET",`/recordings/${encodeURIComponent(n)}/columns?fields=${p}&points=${AR}${g}`);if(d!==a.current)return;s(v),o(v.each>1?`${v.cycles} cycles: of each ${v.each}, the smallest and the largest value. Drag to zoom.`:`${v.cycles} cycles. Drag to zoom, press to place a cursor.`)}catch(v){throw d===a.current&&o(""),v}})};at(()=>(s(null),l(null),()=>{a.current++}),[n,e]);let c=Aa(()=>i?{time_s:i.time_s,values:t.map(({id:f})=>i.columns[f]??[])}:Xx,[i]),{time_s:u}=c;return{samples:c,window:[u[0]??0,u[u.length-1]??1],text:r,each:i?.each??1,read:l}}function NR({curves:n,ids:e,samples:t,window:i,cursors:s,zoomTo:r,place:o}){let a=$t(null),l=$t(null),c=$t({zoomTo:r,place:o});return c.current={zoomTo:r,place:o},at(()=>(l.current=new id(a.current,n,{zoomed:(u,f)=>c.current.zoomTo(u,f),pressed:u=>c.current.place(u)}),()=>l.current?.close()),[e]),at(()=>{t.values.length===n.length&&l.current?.show(t,i,s)},[t,i[0],i[1],s,e]),h("div",{class:"plot",ref:a,role:"img","aria-label":`Curves of ${e||"nothing"}`})}function UR({curves:n,known:e,quantities:t,choose:i}){let[s,r]=Ce(t.find(d=>d.per==="axis")?.name??t[0].name),[o,a]=Ce(""),l=e.filter(d=>d.field===s),c=n.map(d=>d.id),u=l.filter(d=>!o||d.id===o).map(d=>d.id),f={axis:"Of each axis",pose:"Of the platform",robot:"Of the robot"};return h(xt,{children:[h("ul",{class:"chips","aria-label":"Shown curves",children:n.map(({id:d,label:p},g)=>h("li",{children:[h("i",{style:{background:Js(g)}}),p,h("button",{class:"plain","aria-label":`Remove ${p}`,onClick:()=>i(c.filter(v=>v!==d)),children:"\xD7"})]},d))}),h("div",{class:"row",children:[h("label",{children:["Quantity ",h("select",{value:s,onChange:d=>{r(d.currentTarget.value),a("")},children:Object.entries(f).map(([d,p])=>h("optgroup",{label:p,children:t.filter(g=>g.per===d).map(({name:g,meaning:v})=>h("option",{value:g,title:v,children:Vl(g)},g))},d))})]}),l.length>1&&h("label",{children:["Of ",h("select",{value:o,onChange:d=>a(d.currentTarget.value),children:[h("option",{value:"",children:"all"}),l.map(({id:d})=>h("option",{value:d,children:d.slice(s.length+1,-1)},d))]})]}),h("button",{onClick:()=>i([...c,...u.filter(d=>!c.includes(d))]),children:"Add"}),h("button",{onClick:()=>i(u),children:"Show only this"})]}),h("p",{class:"quiet note",children:t.find(d=>d.name===s)?.meaning})]})}var OR=[["off","none"],["edge","edge"],["level","level"]];function FR({trigger:n,change:e,curves:t,rearm:i}){let[s,r]=Ce(String(n.level)),o=t.some(l=>l.id===n.curve),a=l=>e({...n,curve:o?n.curve:t[0]?.id??"",...l});return h("fieldset",{class:"row trigger",children:[h("legend",{class:"hidden",children:"Trigger"}),h("label",{children:["Trigger ",h("select",{value:n.mode,onChange:l=>a({mode:l.currentTarget.value}),children:OR.map(([l,c])=>h("option",{value:l,children:c},l))})]}),n.mode!=="off"&&h(xt,{children:[h("label",{children:["on ",h("select",{value:n.curve,onChange:l=>a({curve:l.currentTarget.value}),children:t.map(({id:l,label:c})=>h("option",{value:l,children:c},l))})]}),h("select",{"aria-label":"Direction",value:String(n.rising),onChange:l=>a({rising:l.currentTarget.value==="true"}),children:[h("option",{value:"true",children:n.mode==="edge"?"rising through":"at or above"}),h("option",{value:"false",children:n.mode==="edge"?"falling through":"at or below"})]}),h("input",{class:"number",inputMode:"decimal","aria-label":"Trigger level",value:s,onInput:l=>{r(l.currentTarget.value),l.currentTarget.value.trim()&&Number.isFinite(Number(l.currentTarget.value))&&a({level:Number(l.currentTarget.value)})}}),h("label",{class:"check",children:[h("input",{type:"checkbox",checked:n.once,onChange:l=>a({once:l.currentTarget.checked})})," once"]}),h("button",{onClick:i,children:"Wait again"})]})]})}function kR({samples:n,window:e,curves:t,cursors:i,change:s,zoomTo:r}){let[o,a]=i,l=(d,p)=>p==null?null:n.values[d]?.[ma(n.time_s,p)]??null,c=(d,p)=>p!==null&&d.labels?.[p]||hs(p),u=o!=null&&a!=null?[Math.min(o,a),Math.max(o,a)]:null,f=(d,p)=>h("label",{class:"slider",children:["Cursor ",d,h("input",{type:"range",min:e[0],max:e[1],step:(e[1]-e[0])/2e3,value:i[p]??e[0],onInput:g=>s(i.map((v,m)=>m===p?Number(g.currentTarget.value):v))}),h("output",{children:i[p]==null?"not placed":`${i[p].toFixed(4)} s`})]});return h("section",{class:"card","aria-labelledby":"cursors",children:[h("h2",{id:"cursors",children:"Cursors"}),f("A",0),f("B",1),u&&u[1]>u[0]&&h("div",{class:"row",children:h("button",{onClick:()=>r(...u),children:"Zoom to the cursors"})}),o==null&&h("p",{class:"quiet note",children:"Press on the curves, or move a slider, to place a cursor."}),(o!=null||a!=null)&&h("div",{class:"scroll",tabIndex:0,role:"region","aria-label":"Values at the cursors",children:h("table",{children:[h("thead",{children:h("tr",{children:[h("th",{children:"curve"}),h("th",{class:"right",children:"A"}),h("th",{class:"right",children:"B"}),h("th",{class:"right",children:"B \u2212 A"})]})}),h("tbody",{children:[h("tr",{children:[h("td",{children:"time, s"}),h("td",{class:"right",children:o?.toFixed(4)??"\u2013"}),h("td",{class:"right",children:a?.toFixed(4)??"\u2013"}),h("td",{class:"right",children:u?hs(a-o):"\u2013"})]}),t.map((d,p)=>{let g=l(p,o),v=l(p,a);return h("tr",{children:[h("td",{children:[h("i",{class:"dot",style:{background:Js(p)}}),d.label]}),h("td",{class:"right",children:c(d,g)}),h("td",{class:"right",children:c(d,v)}),h("td",{class:"right",children:g===null||v===null?"\u2013":hs(v-g)})]},d.id)})]})]})}),u&&u[1]>u[0]&&h(BR,{samples:td(n,...u),curves:t})]})}function BR({samples:n,curves:e}){let[t,i]=Ce(e[0]?.id??""),s=Math.max(0,e.findIndex(u=>u.id===t)),r=e[s],o=r?e.findIndex(u=>u.id===r.id.replace(/^position_rad|^pose(?=\[)/,f=>f==="pose"?"pose_setpoint":"setpoint_rad")):-1,a=r?hm(n,s):null,l=o>=0&&o!==s?hm(n,o)?.to??n.values[o]?.at(-1):null,c=a&&r?[["Step",`${hs(a.from)} to ${hs(a.to)} ${r.unit}`],["Rise time, 10 to 90 %",a.rise_s===null?"\u2013":`${hs(a.rise_s)} s`],["Overshoot",`${(100*a.overshoot).toFixed(1)} %`],["Settling time, within 2 %",a.settling_s===null?"\u2013":`${hs(a.settling_s)} s`],["Steady error",l==null?"add the set-point's curve":`${hs(l-a.to)} ${r.unit}`]]:[];return h("div",{class:"step",children:[h("h3",{children:"Step response"}),h("div",{class:"row",children:h("label",{children:["Curve ",h("select",{value:r?.id,onChange:u=>i(u.currentTarget.value),children:e.map(({id:u,label:f})=>h("option",{value:u,children:f},u))})]})}),a?h("dl",{class:"pairs",children:c.map(([u,f])=>h("div",{children:[h("dt",{children:u}),h("dd",{children:f})]},u))}):h("p",{class:"quiet note",children:"No step between the cursors. Place A where the step begins, and B where the value has settled."})]})}function zR(){let{status:n,events:e,description:t,right:i}=ut(),s=t?.own_programs,r=n?.program??"",o=s?.[r]?.arguments??(r==="path"?{feed:{low:.01,high:1,default:1}}:{}),a=Object.keys(o),[l,c]=Ce(""),[u,f]=Ce(""),d=a.includes(l)?l:a[0]??"",p=Number(u),g=o[d],v=e.filter(m=>m.kind==="set"||m.kind==="command"&&m.text.startsWith("set by"));return h("section",{class:"card","aria-labelledby":"parameters",children:[h("h2",{id:"parameters",children:"Values that may change while a program runs"}),g?h("form",{class:"row",onSubmit:m=>{m.preventDefault(),me.attempt(()=>i.set({[d]:p}))},children:[h("label",{children:["Value of ",r," ",h("select",{value:d,onChange:m=>c(m.currentTarget.value),children:a.map(m=>h("option",{value:m,children:m},m))})]}),h("label",{children:["to ",h("input",{class:"number",inputMode:"decimal",value:u,"aria-describedby":"parameter-range",onInput:m=>f(m.currentTarget.value)})]}),h("button",{disabled:!u.trim()||!Number.isFinite(p),children:"Set"}),h("span",{id:"parameter-range",class:"quiet",children:[g.low," to ",g.high,", ",g.default," by default"]})]}):h("p",{class:"quiet note",children:[r?`The program ${r} has no such values.`:"No program runs."," A path has its feed; your own programs have their arguments."]}),v.length>0&&h("ol",{class:"events",tabIndex:0,"aria-label":"Changes",children:v.map(m=>h("li",{children:[h("time",{children:m.time.slice(11,19)})," ",m.text]},m.number))})]})}var VR=".nc,.ngc,.gcode,.tap,.cnc,.toml,.csv",GR=1<<21,HR=300,WR=150,XR=[10,50,100,500],Yx=n=>!/\.(toml|csv)$/i.test(n),qR=n=>{let e=n.lastIndexOf(".");return`${n.slice(0,e).replace(/[^A-Za-z0-9_. -]/g,"-").replace(/^[-_. ]+/,"").slice(0,48)||"path"}${n.slice(e).toLowerCase()}`},$x=n=>n<60?`${n.toFixed(0)} s`:`${Math.floor(n/60)}:${String(Math.floor(n%60)).padStart(2,"0")} min`,pm=n=>`${n.toFixed(n<10?2:1)} m`;async function YR(n){let{number:e}=await Ct("POST","/path",{...n,client:Wn()});for(;;){let t=await Ct("GET","/path");if(t.number!==e)throw new $n("Another client has planned a path.");if(me.change({path:t}),!t.planning)return;await new Promise(i=>setTimeout(i,HR))}}function Zx(){let{description:n,status:e}=ut();if(!n?.platform||!n.programs.includes("path")||!e||!li())return null;let t=Zn(e).path,i=t&&e.state==="active"&&(e.program==="path"||t.time_s<t.duration_s),s=e.program==="path"&&Zn(e).done===1;return h(Fd,{name:"path",title:"Path",children:[i&&!s&&h(JR,{path:t,running:e.program==="path"}),h($R,{busy:e.program==="path"&&!s})]})}function $R({busy:n}){let{description:e,path:t}=ut(),i=e.platform,[s,r]=Ce(null),[o,a]=Ce({origin:[],blend_mm:"1",scale:"1",rotate_deg:"0",z_mm:""}),[l,c]=Ce(!1),u=t?.planning??!1,f=(g,v,m,_=0)=>{c(!1);let x=Yx(g)?{origin_mm:m.origin.join(" "),blend_mm:Number(m.blend_mm),scale:Number(m.scale),rotate_deg:Number(m.rotate_deg),...m.z_mm.trim()?{z_mm:Number(m.z_mm)}:{}}:{};me.attempt(()=>YR({name:qR(g),text:v,line:_,...x}))},d=async g=>{if(g.size>GR)return me.change({rejected:`${g.name}: ${(g.size/1e6).toFixed(1)} MB; allowed: 2 MB. Use \`cdpr path run\`.`});let v=await g.text(),m={...o,origin:o.origin.length?o.origin:lc(i).slice(0,ki(i).length)};r({name:g.name,text:v}),a(m),f(g.name,v,m)},p=(g,v,m)=>h("label",{children:[h("span",{children:g}),h("input",{inputMode:"decimal",autocomplete:"off",value:v,onInput:_=>{c(!0),a({...o,...m(_.currentTarget.value)})}})]},g);return h("form",{onSubmit:g=>{g.preventDefault(),s&&f(s.name,s.text,o)},children:[h("label",{class:"file",children:[h("input",{type:"file",accept:VR,disabled:u||n,onChange:g=>{let v=g.currentTarget.files?.[0];g.currentTarget.value="",v&&d(v)}}),h("span",{children:s?"Choose another file":"Choose a file"}),h("span",{class:"quiet",children:s?.name??"G-code or way points"})]}),s&&Yx(s.name)&&h("details",{open:l||t?.error!=null,children:[h("summary",{children:"Place and options"}),h("div",{class:"target",children:[ki(i).map((g,v)=>p(`zero ${g}, mm`,o.origin[v]??"",m=>({origin:o.origin.map((_,x)=>x===v?m:_)}))),p("corners, mm",o.blend_mm,g=>({blend_mm:g})),p("scale",o.scale,g=>({scale:g})),p("turn, deg",o.rotate_deg,g=>({rotate_deg:g})),ki(i).length>2&&p("z, if not in the file",o.z_mm,g=>({z_mm:g}))]}),h("div",{class:"row",children:h("button",{disabled:!l||u,children:"Plan again"})})]}),t&&h(ZR,{path:t,stale:l,busy:n,next:s&&t.next_line!=null?()=>f(s.name,s.text,o,t.next_line):null})]})}function ZR({path:n,stale:e,busy:t,next:i}){return n.planning?h("p",{role:"status",children:"Planning: checking workspace, contacts, tensions and torques \u2026"}):n.error?h("p",{class:"verdict bad",role:"status",children:n.error}):n.plan?h(xt,{children:[h("p",{class:"verdict good",role:"status",children:["The robot can follow the path: ",pm(n.length_m??0)," in ",$x(n.duration_s??0),"."]}),n.notices?.map(s=>h("p",{class:"quiet",children:s},s)),n.next_line!=null&&h("p",{class:"quiet",children:["This plan ends before line ",n.next_line,"."]}),h("div",{class:"row",children:[h("button",{type:"button",class:"go",disabled:t||e,onClick:()=>{me.attempt(()=>me.right.program("path",{plan:n.plan}))},children:"Follow the path"}),i&&h("button",{type:"button",disabled:t,onClick:i,children:["Plan from line ",n.next_line]}),h("button",{type:"button",class:"plain",disabled:t,onClick:()=>me.change({path:null}),children:"Discard"})]})]}):null}function JR({path:n,running:e}){let[t,i]=Ce(100),s=!e||n.waiting!=="",r=100*n.time_s/Math.max(n.duration_s,1e-9),o=(n.duration_s-n.time_s)/Math.max(n.feed,.01),a=c=>()=>{me.attempt(()=>e?me.right.set(c):me.right.program("path",c))},l=e?n.waiting||(n.stage==="path"?"Following it":"Moving to it"):"Left";return h("div",{class:"following",children:[h("p",{children:[h("strong",{children:n.name})," ",h("span",{class:"quiet",children:l})]}),h("progress",{max:100,value:r,"aria-label":"Part of the path that is done"}),h("p",{class:"figures",children:[h("span",{children:[r.toFixed(0)," %"]}),h("span",{children:["line ",n.line]}),h("span",{children:[pm(n.along_m)," of ",pm(n.length_m)]}),h("span",{children:[$x(o)," left"]})]}),h("div",{class:"row",children:[s?h("button",{type:"button",class:"go",onClick:a({resume:!0}),children:"Resume the path"}):h("button",{type:"button",onClick:a({pause:!0}),children:"Pause the path"}),h("button",{type:"button",disabled:!s,onClick:a({back_m:t/1e3}),children:"Back"}),h("label",{children:["by ",h("select",{"aria-label":"Distance back",value:t,onChange:c=>i(Number(c.currentTarget.value)),children:XR.map(c=>h("option",{value:c,children:[c," mm"]},c))})]})]}),e&&h(KR,{feed:n.feed})]})}function KR({feed:n}){let[e,t]=Ce(null);at(()=>{if(e===null)return;let s=setTimeout(()=>{me.attempt(()=>me.right.set({feed:e/100})).then(()=>t(null))},WR);return()=>clearTimeout(s)},[e]);let i=e??Math.round(100*n);return h("label",{class:"feed",children:[h("span",{children:"Feed"}),h("input",{type:"range",min:1,max:100,value:i,onInput:s=>t(Number(s.currentTarget.value))}),h("span",{children:[i," %"]})]})}var jR=.9;function QR(){let{status:n,description:e,right:t,connected:i}=ut(),{tone:s,title:r}=zd(),o=n?.real_time_factor,a=n?.control.procedure?`, lent to the ${n.control.procedure}`:"",l=t.held?"You have the right to move":n?.control.held?`${n.control.client} has the right to move`:"";return h("header",{children:[h("img",{src:"page/icon.svg",alt:"",width:"28",height:"28"}),h("div",{class:"who",children:[h("strong",{children:e?.robot??n?.robot??"cdpr-rt"}),h("span",{class:"facts",children:[e&&h("span",{children:e.simulated?"simulated":"real drives"}),i&&o!=null&&o<jR&&h("span",{children:["runs at ",o.toFixed(2)," of real time"]}),l&&h("span",{children:[l,a]})]})]}),h("span",{class:`pill ${s}`,children:r.length>40?`${r.slice(0,38)}\u2026`:r}),h("div",{class:"stops",children:[h(xg,{}),h(vg,{})]})]})}function eP(){return h("div",{class:"columns",children:[h("div",{class:"column wide",children:[h(Zh,{}),h(vx,{}),h(yx,{}),h(Sg,{})]}),h("div",{class:"column",children:[h(gg,{}),h(Zx,{}),h(_x,{}),h(xx,{}),h(bx,{})]})]})}var tP=[{name:"robot",title:"Robot",component:eP},{name:"scope",title:"Scope",component:qx},{name:"recordings",title:"Recordings",component:Fx},{name:"drives",title:"Drives and bus",component:Ox},{name:"commission",title:"Commission",component:Rx},{name:"calibrate",title:"Calibrate",component:Ax},{name:"describe",title:"Describe",component:Dx}];function nP(){let{description:n,connected:e}=ut(),{view:t}=nc(),i=tP.filter(({suits:a},l)=>l===0||li()&&n&&(a?.(n)??!0)),{name:s,title:r,component:o}=i.find(a=>a.name===t)??i[0];return at(()=>{document.title=`${r} \u2013 ${n?.robot??"cdpr-rt"}`,scrollTo(0,0)},[s,n?.robot]),h(xt,{children:[h("div",{class:"top",children:[h(QR,{}),i.length>1&&h("nav",{"aria-label":"Views",children:i.map(a=>h("a",{href:Zi(a.name),"aria-current":a.name===s?"page":void 0,children:a.title},a.name))}),h(yg,{})]}),h("main",{class:e?"":"stale",children:[h(bg,{}),h(o,{})]})]})}qm(h(nP,{}),document.body);
